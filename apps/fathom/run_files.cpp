#include "run_files.hpp"

#include <fmt/format.h>

#include <chrono>

#include "measure/system.hpp"

namespace fathom::cli {

namespace trace = engine::trace;

RunFiles::RunFiles(const RunFileSettings& settings, const Scene& scene, SceneInstance& instance, World& world)
    : instance_(instance), world_(world) {
  if (!settings.trace.empty()) {
    trace_.emplace(settings.trace);
    trace::name_thread("run");
    if (world.definition().simulator == SimulatorKind::device) device_track_ = world.hardware();
  }
  if (settings.record.empty()) return;
  recorder_ = std::make_unique<engine::Recorder>(settings.record, settings.recording);
  runner_.emplace(world);
  for (const BodyId id : instance.ids()) handles_.push_back({id.index, id.generation});
  script_.emplace(scene, handles_);
  stream_ = scene.stream;
}

void RunFiles::prepare_step() {
  const trace::Zone zone("scene");
  if (!recorder_) return instance_.prepare_step();
  const std::uint64_t step = world_.step_count() + 1;
  commands_.clear();
  script_->before_step(step, *runner_, commands_);
  recorder_->before_step(step, commands_, *runner_);
  runner_->run(commands_);
  if (const auto renewed = stream_ ? stream_->due(step - 1) : std::nullopt)
    instance_.replaced(*renewed, runner_->body(handles_[*renewed]));
}

void RunFiles::after_step(double step_ms) {
  if (trace::enabled()) {
    using Milliseconds = std::chrono::duration<double, std::milli>;
    const auto begin = std::chrono::steady_clock::now() -
                       std::chrono::duration_cast<std::chrono::steady_clock::duration>(Milliseconds(step_ms));
    trace::add_zone("step", begin, step_ms);
    trace::add_step(world_.profile().times, begin, device_track_);
    trace::count("contact points", world_.profile().counts.points);
  }
  if (recorder_) recorder_->after_step(world_);
}

void RunFiles::finish() {
  if (recorder_) recorder_->finish();
  if (!trace_) return;
  trace_->finish();
  if (trace_->lost_count() > 0)
    tell(fmt::format("fathom: {} zones were lost: the trace is full\n", trace_->lost_count()));
}

}  // namespace fathom::cli
