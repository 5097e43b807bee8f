// Recordings: a run's inputs, state hashes and snapshots in one file, and their replay.
//
// The file is a header (magic "FATHOMRC", format version, length and XXH3 checksum of the rest) and one zstd frame of
// entries: a snapshot of the world, then for every step its commands, its state hash and, if requested, its state as
// the difference from the last step's. Snapshots repeat at a fixed interval of steps. The file is written under a
// temporary name and renamed when complete. Numbers are little-endian, floats IEEE 754.
#pragma once

#include <cstdint>
#include <fathom/world.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "engine/simulation.hpp"

namespace fathom::engine {

struct RecordSettings {
  int snapshot_every = 300;  ///< steps, ≥ 1
  bool states = true;        ///< every step's poses and velocities, for a replay to find what differs first
};

/// Writes a recording. Make it a `Simulation`'s observer, or call its two functions around your own world's steps.
class Recorder final : public SimulationObserver {
 public:
  /// Throws `Error{file}` if the folder cannot be written.
  Recorder(std::string path, RecordSettings settings);
  /// Without `finish` no file remains.
  ~Recorder() override;

  void before_step(std::uint64_t step, const CommandList& commands, const CommandRunner& runner) override;
  void after_step(const World& world) override;
  /// Completes the file. Throws `Error{file}` if it cannot be written.
  void finish();

  std::uint64_t steps() const;
  std::uint64_t bytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Where a replay first differed.
struct Difference {
  std::uint64_t step = 0;      ///< the first step whose hash differs
  std::uint64_t seen_at = 0;   ///< the step whose states were compared: the same, or that of the next snapshot
  std::optional<BodyId> body;  ///< the first body that differs; none if only the hash does
  std::string field;           ///< "position.x", …, "angular velocity.z", or "existence"
  double recorded = 0, replayed = 0;

  std::string text() const;
};

struct ReplayResult {
  std::uint64_t first_step = 0, steps = 0;
  std::uint64_t state_hash = 0;  ///< at the end
  std::optional<Difference> difference;
};

struct ReplaySettings {
  int threads = 0;              ///< of the world; 0: as many as the machine has
  std::string device{"auto"};   ///< for a run of the device simulator
  bool check_snapshots = true;  ///< compare contacts and sleep with every recorded snapshot (native simulator)
  /// Called once before the first step, when the initial state exists.
  std::function<void(const World& world)> before_first_step{};
  /// Called after each step; tests change the world here.
  std::function<void(std::uint64_t step, World& world)> after_step{};
};

/// Repeats the run and checks the hash of every step, up to the first difference. Throws `Error{file}` if the file is
/// truncated, altered, or of another version.
ReplayResult replay(const std::string& path, const ReplaySettings& settings = {});

}  // namespace fathom::engine
