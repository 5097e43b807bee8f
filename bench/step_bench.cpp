// Whole steps of the four environments, always the same steps, with the mean time of each stage (s).
#include <benchmark/benchmark.h>

#include <chrono>

#include "scene/environments.hpp"

namespace fathom {
namespace {

constexpr int first_step = 120;  // by then the bodies of `spread` and the lower layers have landed
constexpr int steps = 200;

using Clock = std::chrono::steady_clock;

void add(StageTimes& sum, const StageTimes& t) {
  sum.find_pairs += t.find_pairs;
  sum.update_manifolds += t.update_manifolds;
  sum.build_constraints += t.build_constraints;
  sum.solve += t.solve;
  sum.finish += t.finish;
}

void report(benchmark::State& state, const StageTimes& sum, const StepCounts& last) {
  const auto mean = [](double total_ms) {
    return benchmark::Counter(1e-3 * total_ms, benchmark::Counter::kAvgIterations);
  };
  state.counters["find_pairs"] = mean(sum.find_pairs);
  state.counters["update_manifolds"] = mean(sum.update_manifolds);
  state.counters["build_constraints"] = mean(sum.build_constraints);
  state.counters["solve"] = mean(sum.solve);
  state.counters["finish"] = mean(sum.finish);
  state.counters["pairs"] = last.pairs;
  state.counters["manifolds"] = last.manifolds;
}

// Arguments: size (bodies, for `pyramid` layers), threads.
void step(benchmark::State& state, Scene (*make)(std::int64_t)) {
  Scene scene = make(state.range(0));
  scene.world.threads = static_cast<int>(state.range(1));
  World world(scene.world);
  SceneInstance instance(scene, world);
  const auto step_once = [&] {
    instance.prepare_step();
    const Clock::time_point start = Clock::now();
    world.step();
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  for (int i = 0; i < first_step; ++i) step_once();
  StageTimes sum;
  for (auto _ : state) {
    state.SetIterationTime(step_once());
    add(sum, world.profile().times);
  }
  report(state, sum, world.profile().counts);
}

void sizes(benchmark::internal::Benchmark* b, std::initializer_list<std::int64_t> list) {
  b->ArgNames({"size", "threads"})->UseManualTime()->Iterations(steps)->Unit(benchmark::kMillisecond);
  for (const std::int64_t size : list)
    for (const std::int64_t threads : {1, 2}) b->Args({size, threads});
}
void bodies(benchmark::internal::Benchmark* b) { sizes(b, {100, 1000, 10000}); }
void layer_counts(benchmark::internal::Benchmark* b) { sizes(b, {5, 10, 15, 30}); }

BENCHMARK_CAPTURE(step, drift, drift)->Apply(bodies);
BENCHMARK_CAPTURE(step, layers, layers)->Apply(bodies);
BENCHMARK_CAPTURE(step, spread, spread)->Apply(bodies);
BENCHMARK_CAPTURE(step, pyramid, pyramid)->Apply(layer_counts);

// The end of a step alone, per body: in `drift` most bodies are free, and it integrates them; in `spread` all lie on
// the ground, and it adopts the solver's results.
void finish(benchmark::State& state, Scene (*make)(std::int64_t)) {
  Scene scene = make(1000);
  scene.world.threads = 1;
  World world(scene.world);
  SceneInstance instance(scene, world);
  for (int i = 0; i < first_step; ++i) world.step();
  for (auto _ : state) {
    world.step();
    state.SetIterationTime(1e-3 * world.profile().times.finish);
  }
  state.counters["per_body"] = {static_cast<double>(dynamic_body_count(scene)),
                                benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert};
}
BENCHMARK_CAPTURE(finish, free_bodies, drift)->UseManualTime()->Iterations(steps)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(finish, resting_bodies, spread)->UseManualTime()->Iterations(steps)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace fathom
