#include "measure.hpp"

#include <chrono>
#include <optional>

#include "measure/counted.hpp"
#include "measure/system.hpp"

namespace fathom::peers {
namespace {

struct States {
  std::vector<Pose> poses;
  std::vector<Velocity> velocities;

  States(const Engine& engine, const Scene& scene) : poses(scene.bodies.size()), velocities(scene.bodies.size()) {
    engine.read(poses, velocities);
  }
};

Vec3 random_vector(Random& random, float limit) {
  const auto within = static_cast<double>(limit);
  const auto x = static_cast<float>(random.symmetric(within));
  const auto y = static_cast<float>(random.symmetric(within));
  const auto z = static_cast<float>(random.symmetric(within));
  return {x, y, z};
}

/// The kicks of SceneInstance, exactly, for any engine.
void kick(Engine& engine, const Scene& scene, Random& random) {
  const States now(engine, scene);
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    if (scene.bodies[i].motion != MotionType::dynamic) continue;
    Velocity v = now.velocities[i];
    v.linear += random_vector(random, scene.kicks->linear);
    v.angular += random_vector(random, scene.kicks->angular);
    engine.set_velocity(i, v);
  }
}

/// Engines create bodies at rest, so set their velocities.
void set_going(Engine& engine, const Scene& scene) {
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const Velocity& v = scene.bodies[i].velocity;
    const bool is_at_rest = v.linear == Vec3{} && v.angular == Vec3{};
    if (scene.bodies[i].motion == MotionType::dynamic && !is_at_rest) engine.set_velocity(i, v);
  }
}

double timed_step(Engine& engine) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  engine.step();
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

std::string what_went_wrong(const Engine& engine, const Quality& quality) {
  if (quality.non_finite > 0) return counted(quality.non_finite, "body", "bodies") + " not finite";
  if (quality.bodies_below_ground > 0)
    return counted(quality.bodies_below_ground, "body", "bodies") + " below the ground";
  if (quality.escaped > 0) return counted(quality.escaped, "body", "bodies") + " escaped";
  return engine.trouble();
}

}  // namespace

Measurement measure(const EngineKind& kind, const Scene& scene, int threads, int steps, double limit) {
  Measurement result;
  std::unique_ptr<Engine> engine;
  std::vector<double> step_ms;
  step_ms.reserve(static_cast<std::size_t>(steps));
  double total_ms = 0;
  try {
    if (kind.name != "fathom") refuse_rounded(kind.name, scene);
    engine = kind.create(scene, threads);
    set_going(*engine, scene);
    Random random(scene.kicks ? scene.kicks->seed : 0);
    std::optional<Orbiter> orbiter;
    if (scene.orbit) orbiter.emplace(scene);
    for (int step = 0; step < steps && !result.cut_short && !InterruptGuard::requested(); ++step) {
      if (scene.kicks && step % scene.kicks->interval == 0) kick(*engine, scene, random);
      if (orbiter)
        for (const Orbiter::Target& target : orbiter->due(static_cast<std::uint64_t>(step))) engine->move(target);
      step_ms.push_back(timed_step(*engine));
      total_ms += step_ms.back();
      result.cut_short = step + 1 < steps && total_ms > 1e3 * limit;
    }
  } catch (const Error& error) {
    result.trouble = error.what();
    return result;
  }
  const States end(*engine, scene);
  result.steps = static_cast<int>(step_ms.size());
  result.step_ms = statistics(step_ms);
  result.quality = measure_quality(scene, end.poses, end.velocities);
  result.trouble = what_went_wrong(*engine, result.quality);
  return result;
}

}  // namespace fathom::peers
