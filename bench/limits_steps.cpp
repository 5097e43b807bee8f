// The stages of steps against memory bandwidth.
#include <algorithm>

#include "limits_bench.hpp"
#include "scene/environments.hpp"

namespace fathom::bench {
namespace {

/// Bytes that a stage must read and write if all its bodies and contacts take part, each array once per pass: poses and
/// velocities of 32 bytes, boxes of 24, manifolds of 96, three impulses of 4 per point. A stage that skips unchanged
/// data exceeds 1.
/// changed exceeds 1.
struct StageBytes {
  double find_pairs, update_manifolds, solve;

  StageBytes(const StepCounts& c, int substeps)
      : find_pairs(c.active * (32.0 + 24) + c.pairs * 8.0),
        update_manifolds(c.active * 32.0 + c.manifolds * 96.0),
        // A sweep and a relax sweep per substep read manifolds and change impulses and bodies.
        solve(substeps * (c.active * 128.0 + 2 * (c.manifolds * 96.0 + c.points * 24.0)) + c.active * 64.0) {}
};

}  // namespace

void register_steps(const WorldDef& wanted, const std::string& where, double bandwidth) {
  struct Entry {
    const char* environment;
    std::int64_t bodies;
    int settle;  ///< steps before the first timed one
  };
  for (const Entry& entry : {Entry{"drift", 10'000, 60},
                             {"spread", 10'000, 60},
                             {"pyramid", 9'455, 60},
                             {"drift", 100'000, 30},
                             {"spread", 100'000, 30}}) {
    const std::string name = "step/" + where + "/" + entry.environment + "/" + std::to_string(entry.bodies);
    benchmark::RegisterBenchmark(
        name.c_str(),
        [=](benchmark::State& state) {
          Scene scene = find_environment(entry.environment)->make(entry.bodies);
          scene.world.simulator = wanted.simulator, scene.world.device = wanted.device;
          scene.world.threads = wanted.threads;
          World world(scene.world);
          SceneInstance instance(scene, world);
          for (int i = 0; i < entry.settle; ++i) instance.prepare_step(), world.step();
          StageTimes sum;
          double share[3] = {}, steps = 0;
          for (auto _ : state) {
            instance.prepare_step();
            world.step();
            const Profile& p = world.profile();
            const StageBytes bytes(p.counts, scene.world.solver.substeps);
            const StageTimes& t = p.times;
            const double resolution = t.collision_resolution();
            share[0] += bytes.find_pairs / bandwidth / (1e-3 * std::max(t.find_pairs, 1e-6));
            share[1] += bytes.update_manifolds / bandwidth / (1e-3 * std::max(t.update_manifolds, 1e-6));
            share[2] += bytes.solve / bandwidth / (1e-3 * std::max(resolution, 1e-6));
            sum.find_pairs += t.find_pairs, sum.update_manifolds += t.update_manifolds, sum.solve += resolution;
            ++steps;
            state.SetIterationTime(1e-3 * t.total());
          }
          state.counters["pairs_us"] = 1e3 * sum.find_pairs / steps,
          state.counters["pairs_of_limit"] = share[0] / steps;
          state.counters["manifolds_us"] = 1e3 * sum.update_manifolds / steps;
          state.counters["manifolds_of_limit"] = share[1] / steps;
          state.counters["resolution_us"] = 1e3 * sum.solve / steps;
          state.counters["resolution_of_limit"] = share[2] / steps;
        })
        ->UseManualTime()
        ->Unit(benchmark::kMicrosecond);
  }
}

}  // namespace fathom::bench
