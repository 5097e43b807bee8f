// Repeats a recorded run and compares.
#include <fmt/format.h>

#include <bit>
#include <cstring>

#include "engine/recording.hpp"
#include "engine/recording_format.hpp"

namespace fathom::engine {
namespace {

/// The recorded state of all slots.
struct Recorded {
  std::span<const std::uint32_t> words;
  std::uint32_t slots;
};

void compare(const World& world, const Recorded& recorded, Difference& difference) {
  std::uint32_t now[StateDelta::words_per_slot];
  for (const BodyId id : world.bodies()) {
    difference.body = id;
    difference.field = "existence";
    if (id.index >= recorded.slots) return;
    state_words(world.poses()[id.index], world.velocities()[id.index], now);
    const std::uint32_t* then = recorded.words.data() + id.index * StateDelta::words_per_slot;
    for (std::size_t word = 0; word < StateDelta::words_per_slot; ++word) {
      if (now[word] == then[word]) continue;
      difference.field = word_name(word);
      difference.recorded = static_cast<double>(std::bit_cast<float>(then[word]));
      difference.replayed = static_cast<double>(std::bit_cast<float>(now[word]));
      return;
    }
  }
  difference.body.reset();
  difference.field.clear();
}

WorldDef definition(const ReplaySettings& settings) {
  WorldDef def;
  def.threads = settings.threads;
  def.device = settings.device;
  return def;
}

class Replay {
 public:
  Replay(const std::string& path, const ReplaySettings& settings)
      : path_(path), settings_(settings), file_(path, recording_kind), world_(definition(settings)) {}

  ReplayResult run() {
    for (;;) {
      switch (file_.read<Entry>()) {
        case Entry::snapshot:
          if (snapshot()) return result_;
          break;
        case Entry::commands:
          step();
          break;
        case Entry::state:
          state();
          break;
        case Entry::hash:
          if (hash()) return result_;
          break;
        case Entry::end:
          if (file_.read<std::uint64_t>() != steps_read_) file_.fail("its number of steps is wrong; it was altered");
          return result_;
        default:
          file_.fail("it holds an unknown entry; it was altered or written by a newer build");
      }
    }
  }

 private:
  /// True if the replay ends here because an earlier difference has been examined.
  bool snapshot() {
    const std::vector<std::byte> bytes = file_.read_bytes(file_.read<std::uint64_t>());
    const std::vector<std::byte> entries = file_.read_bytes(file_.read<std::uint64_t>());
    if (!runner_) {
      restore(world_, bytes);
      runner_.emplace(world_);
      set_entries(entries);
      result_.first_step = world_.step_count() + 1;
      return false;
    }
    if (!result_.difference && !settings_.check_snapshots) return false;
    World recorded(definition(settings_));
    restore(recorded, bytes);
    if (result_.difference) {
      StateDelta then;
      then.encode(recorded);
      compare(world_, {then.words(), then.slots()}, *result_.difference);
      result_.difference->seen_at = world_.step_count();
      return true;
    }
    check_hidden_state(bytes);
    return result_.difference.has_value();
  }

  // Hashes cover poses and velocities; a snapshot also contains contacts, trees and sleep. On a device the order of
  // contacts is arbitrary.
  void check_hidden_state(const std::vector<std::byte>& bytes) {
    std::vector<std::byte> now;
    world_.save(now);
    if (now == bytes || world_.definition().simulator != SimulatorKind::native) return;
    result_.difference = Difference{world_.step_count(), world_.step_count(), {}, "contacts or sleep", 0, 0};
  }

  void restore(World& world, const std::vector<std::byte>& bytes) {
    try {
      world.restore(bytes);
    } catch (const Error& error) {
      file_.fail(error.what());
    }
  }

  void set_entries(const std::vector<std::byte>& bytes) {
    std::vector<CommandRunner::Entry> entries(bytes.size() / sizeof(CommandRunner::Entry));
    if (entries.size() * sizeof(CommandRunner::Entry) != bytes.size())
      file_.fail("a snapshot's list of bodies is broken");
    if (!bytes.empty()) std::memcpy(entries.data(), bytes.data(), bytes.size());
    try {
      runner_->set_entries(std::move(entries));
    } catch (const Error& error) {
      file_.fail(error.what());
    }
  }

  void step() {
    if (!runner_) file_.fail("it does not begin with a snapshot; it was altered");
    const CommandList commands = commands_from(file_.read_bytes(file_.read<std::uint64_t>()), path_);
    runner_->run(commands);
    if (settings_.before_first_step && world_.step_count() + 1 == result_.first_step)
      settings_.before_first_step(world_);
    world_.step();
    state_is_current_ = false;
    if (settings_.after_step) settings_.after_step(world_.step_count(), world_);
  }

  void state() {
    const auto slots = file_.read<std::uint32_t>();
    states_.decode(slots, file_.read_bytes(std::uint64_t{slots} * StateDelta::words_per_slot * 4));
    state_is_current_ = true;
  }

  bool hash() {
    const auto step = file_.read<std::uint64_t>();
    const auto recorded = file_.read<std::uint64_t>();
    ++steps_read_;
    if (result_.difference) return false;
    if (step != world_.step_count()) file_.fail("its steps are not in order; it was altered");
    ++result_.steps;
    result_.state_hash = world_.state_hash();
    if (result_.state_hash == recorded) return false;
    result_.difference = Difference{step, step, {}, {}, 0, 0};
    if (!state_is_current_) return false;  // the next snapshot will show it
    compare(world_, {states_.words(), states_.slots()}, *result_.difference);
    return true;
  }

  std::string path_;
  const ReplaySettings& settings_;
  ZstdReader file_;
  World world_;
  std::optional<CommandRunner> runner_;
  StateDelta states_;
  bool state_is_current_ = false;
  std::uint64_t steps_read_ = 0;
  ReplayResult result_;
};

}  // namespace

std::string Difference::text() const {
  std::string out = fmt::format("step {} differs from the recording", step);
  if (!body && field.empty())
    return out + (seen_at == step ? "; record with record.states = true to see the body"
                                  : fmt::format("; at step {}, the next snapshot, all bodies agree again", seen_at));
  if (seen_at != step) out += fmt::format("; seen at step {}, the next snapshot", seen_at);
  if (!body) return out + ": " + field;
  out += fmt::format(": body {{index {}, generation {}}}, {}", body->index, body->generation, field);
  if (field == "existence") return out;
  return out + fmt::format(": recorded {:.9g}, replayed {:.9g}", recorded, replayed);
}

ReplayResult replay(const std::string& path, const ReplaySettings& settings) { return Replay(path, settings).run(); }

}  // namespace fathom::engine
