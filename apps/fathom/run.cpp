#include "run.hpp"

#include <algorithm>
#include <chrono>

#include "measure/system.hpp"

namespace fathom::cli {
namespace {

double timed_step(World& world) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  world.step();
  world.profile();  // the device simulator returns before the step has run; reading waits for it
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

void record(RunResult& result, const Profile& profile, double step_ms) {
  result.step.push_back(step_ms);
  result.broad_phase.push_back(profile.times.broad_phase());
  result.narrow_phase.push_back(profile.times.narrow_phase());
  result.collision_resolution.push_back(profile.times.collision_resolution());
}

void reserve(RunResult& result, std::uint64_t steps) {
  // A reallocation during a run would show as a slow step; beyond this size it hardly does.
  const auto room = static_cast<std::size_t>(std::min<std::uint64_t>(steps, 1'000'000));
  for (auto* series : {&result.step, &result.broad_phase, &result.narrow_phase, &result.collision_resolution}) {
    series->reserve(room);
  }
}

}  // namespace

RunResult simulate(const Scene& scene, std::uint64_t steps, const RunFileSettings& file_settings,
                   const StepObserver& observe) {
  World world(scene.world);
  SceneInstance instance(scene, world);
  RunFiles files(file_settings, scene, instance, world);
  RunResult result;
  reserve(result, steps);
  // A body in quarantine has a finite pose again, although its state was not finite.
  std::set<std::uint32_t> quarantined;
  while (result.step.size() < steps && !InterruptGuard::requested()) {
    files.prepare_step();
    const double step_ms = timed_step(world);
    files.after_step(step_ms);
    record(result, world.profile(), step_ms);
    for (const Quarantine& event : world.quarantined()) quarantined.insert(event.body.index);
    observe(world.profile(), step_ms);
  }
  result.interrupted = result.step.size() < steps;
  world.wait();
  files.finish();
  result.hardware = world.hardware();
  result.last = world.profile();
  result.quality = measure_quality(scene, instance, world);
  result.quality.non_finite += quarantined.size();
  result.state_hash = world.state_hash();
  return result;
}

}  // namespace fathom::cli
