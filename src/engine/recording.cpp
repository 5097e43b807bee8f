#include "engine/recording.hpp"

#include "engine/recording_format.hpp"
#include "engine/trace.hpp"

namespace fathom::engine {

struct Recorder::State {
  State(std::string path, RecordSettings settings_) : settings(settings_), file(std::move(path), recording_kind) {}

  template <class T>
  void put(const T& value) {
    file.write(std::as_bytes(std::span(&value, 1)));
  }
  void put_sized(std::span<const std::byte> bytes) {
    put(static_cast<std::uint64_t>(bytes.size()));
    file.write(bytes);
  }

  RecordSettings settings;
  ZstdWriter file;
  StateDelta states;
  std::vector<std::byte> snapshot;
  std::uint64_t steps = 0;
};

Recorder::Recorder(std::string path, RecordSettings settings) {
  if (settings.snapshot_every < 1)
    throw Error(ErrorCode::invalid_argument, "recording: snapshots every " + std::to_string(settings.snapshot_every) +
                                                 " steps asked for; give at least 1");
  state_ = std::make_unique<State>(std::move(path), settings);
}

Recorder::~Recorder() = default;

void Recorder::before_step(std::uint64_t, const CommandList& commands, const CommandRunner& runner) {
  const trace::Zone zone("record");
  State& s = *state_;
  if (s.steps % static_cast<std::uint64_t>(s.settings.snapshot_every) == 0) {
    runner.world().save(s.snapshot);
    s.put(Entry::snapshot);
    s.put_sized(s.snapshot);
    s.put_sized(std::as_bytes(std::span(runner.entries())));
  }
  s.put(Entry::commands);
  s.put_sized(to_bytes(commands));
}

void Recorder::after_step(const World& world) {
  const trace::Zone zone("record");
  State& s = *state_;
  ++s.steps;
  if (s.settings.states) {
    const std::vector<std::byte>& change = s.states.encode(world);
    s.put(Entry::state);
    s.put(s.states.slots());
    s.file.write(change);
  }
  s.put(Entry::hash);
  s.put(world.step_count());
  s.put(world.state_hash());
}

void Recorder::finish() {
  state_->put(Entry::end);
  state_->put(state_->steps);
  state_->file.finish();
}

std::uint64_t Recorder::steps() const { return state_->steps; }
std::uint64_t Recorder::bytes() const { return state_->file.bytes_written(); }

}  // namespace fathom::engine
