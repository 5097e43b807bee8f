// The entries of a recording; see recording.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/command_runner.hpp"
#include "engine/zstd_file.hpp"

namespace fathom::engine {

inline constexpr FileKind recording_kind{0x43524d4f48544146, 13, "recording",  // "FATHOMRC"
                                         "give the path of what 'fathom run --record FILE' or an engine wrote"};

enum class Entry : std::uint8_t {
  snapshot = 1,  ///< size, World::save; size, entries of the CommandRunner
  commands = 2,  ///< size, a command list; the step follows
  state = 3,     ///< slots, difference from the last state
  hash = 4,      ///< step, state hash
  end = 5,       ///< steps
};

std::vector<std::byte> to_bytes(const CommandList& commands);
/// Throws `Error{file}`.
CommandList commands_from(std::span<const std::byte> bytes, const std::string& what);

/// Poses and velocities of all slots as words, and their difference from step to step: XOR with the last step's, split
/// into byte planes, so slow bodies yield long runs of zeros.
class StateDelta {
 public:
  /// The words of the world's current state, as the difference from the last call.
  const std::vector<std::byte>& encode(const World& world);
  /// Undoes `encode`.
  void decode(std::uint32_t slots, std::span<const std::byte> bytes);

  static constexpr std::size_t words_per_slot = 13;
  /// Per slot: position, rotation (w, x, y, z), linear and angular velocity, as bits of floats.
  std::span<const std::uint32_t> words() const { return words_; }
  std::uint32_t slots() const { return static_cast<std::uint32_t>(words_.size() / words_per_slot); }

 private:
  std::vector<std::uint32_t> words_, now_;
  std::vector<std::byte> bytes_;
};

/// The words of one slot.
void state_words(const Pose& pose, const Velocity& velocity, std::uint32_t* words);
/// "position.x" … "angular velocity.z".
const char* word_name(std::size_t word);

}  // namespace fathom::engine
