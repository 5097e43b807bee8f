#include "run_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>

#include "measure/counted.hpp"
#include "measure/system.hpp"

namespace fathom::campaign {
namespace {

using Clock = std::chrono::steady_clock;

// Reading all bodies evicts the caches: do it rarely enough not to affect the 99th percentile.
constexpr std::uint64_t quality_interval = 180;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// A running world. Devices are ahead of what is read, so a step's profile arrives some steps later.
class Runner {
 public:
  Runner(const Case& what, const Scene& scene) : scene_(scene), world_(scene.world), instance_(scene, world_) {
    result_.what = what;
    result_.hardware = world_.hardware();
    result_.bodies = dynamic_body_count(scene);
    result_.samples.reserve(published_steps);
  }

  void step() {
    instance_.prepare_step();
    const Clock::time_point start = Clock::now();
    world_.step();
    const Profile& profile = world_.profile();
    const double wall = seconds_since(start);
    result_.wall_seconds += wall;
    ++result_.steps;
    take(profile, 1e3 * wall);
    // Reading events waits for all steps in flight; the profile is that of the newest finished step.
    if (profile.counts.quarantined > 0)
      for (const Quarantine& event : world_.quarantined()) quarantined_.insert(event.body.index);
    if (result_.steps % quality_interval == 0) look();
  }

  bool exploded() const { return !result_.refused.empty(); }
  const World& world() const { return world_; }
  double seconds() const { return result_.wall_seconds; }

  Measurement finish(bool cut_short) {
    world_.wait();
    take(world_.profile(), 0);
    if (result_.quality.empty() || result_.quality.back().step != result_.steps) look();
    const Quality& end = result_.end();
    if (end.bodies_below_ground > 0)
      result_.failing = counted(end.bodies_below_ground, "body", "bodies") + " below the ground";
    result_.hash = fmt::format("{:016x}", world_.state_hash());
    result_.memory_bytes = world_.profile().counts.memory_bytes;
    result_.interruptions = interruptions() - interruptions_before_;
    result_.cut_short = cut_short;
    result_.summary = summarise(result_.samples);
    return std::move(result_);
  }

 private:
  void take(const Profile& p, double wall_ms) {
    if (p.step == 0 || (!result_.samples.empty() && p.step <= result_.samples.back().step)) return;
    const double total = p.interval > 0 ? p.interval : wall_ms > 0 ? wall_ms : p.times.total();
    result_.samples.push_back({p.step, total, p.times.broad_phase(), p.times.narrow_phase(),
                               p.times.collision_resolution(), p.counts.pairs, p.counts.manifolds, p.counts.points});
  }

  void look() {
    Quality quality = measure_quality(scene_, instance_, world_);
    quality.non_finite += quarantined_.size();
    result_.quality.push_back({result_.steps, quality});
    result_.refused = refusal(scene_, quality, result_.steps);
  }

  const Scene& scene_;
  World world_;
  SceneInstance instance_;
  Measurement result_;
  std::uint64_t interruptions_before_ = interruptions();
  // A body in quarantine has a finite pose again, although its state was not finite.
  std::set<std::uint32_t> quarantined_;
};

}  // namespace

std::string refusal(const Scene& scene, const Quality& quality, std::uint64_t steps) {
  if (quality.non_finite > 0) return fmt::format("{} states not finite", quality.non_finite);
  // No body may have more energy than gravity and kicks can give it.
  double height = 0, mass = 0, bodies = 0;
  for (const BodyDef& body : scene.bodies) {
    if (body.motion != MotionType::dynamic) continue;
    const double m = body.mass ? static_cast<double>(*body.mass) : 1.0;
    const double above = std::max(0.0, static_cast<double>(body.pose.position.z - scene.ground_height.value_or(0)));
    height += m * above, mass += m, bodies += 1;
  }
  if (bodies == 0) return {};
  double allowed = scene.ground_height ? static_cast<double>(length(scene.world.gravity)) * height / bodies : 0;
  if (scene.kicks) {
    const double kicks = std::ceil(static_cast<double>(steps) / scene.kicks->interval);
    const double speed = kicks * std::sqrt(3.0) * static_cast<double>(scene.kicks->linear + scene.kicks->angular);
    allowed += 0.5 * mass / bodies * speed * speed;
  }
  allowed = 1.1 * allowed + 1;
  if (quality.kinetic_energy_per_body <= allowed) return {};
  return fmt::format("exploded: {:.3g} J per body, where at most {:.3g} J can be", quality.kinetic_energy_per_body,
                     allowed);
}

std::optional<Measurement> run_case(const Case& what, const RunLimits& limits, const StepObserver& observe) {
  const Scene scene = make_scene(what);
  try {
    Runner runner(what, scene);
    if (!observe(0, runner.world())) return std::nullopt;
    bool cut_short = false;
    for (std::uint64_t step = 1; step <= limits.steps && !runner.exploded() && !cut_short; ++step) {
      runner.step();
      if (!observe(step, runner.world())) return std::nullopt;
      cut_short = step < limits.steps && runner.seconds() > limits.seconds;
    }
    return runner.finish(cut_short);
  } catch (const Error& error) {
    Measurement none;
    none.what = what;
    none.bodies = dynamic_body_count(scene);
    none.skipped = error.what();
    return none;
  }
}

}  // namespace fathom::campaign
