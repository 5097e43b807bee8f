// Broad phase at the density of `drift`: one body per 64 m³. Counter `items` is boxes per second.
#include <benchmark/benchmark.h>

#include "stage_fixture.hpp"

namespace fathom::native {
namespace {

void sizes(benchmark::internal::Benchmark* b) { b->Arg(1000)->Arg(10000)->Arg(100000)->Unit(benchmark::kMicrosecond); }

void count_boxes(benchmark::State& state) { state.SetItemsProcessed(state.iterations() * state.range(0)); }

void bvh_build(benchmark::State& state) {  // a radix sort, then one refit
  const StageFixture scene(drift(state.range(0)));
  Bvh tree;
  ThreadPool pool(1);
  for (auto _ : state) tree.build(scene.moving, scene.state.bounds.data(), pool);
  count_boxes(state);
}
BENCHMARK(bvh_build)->Apply(sizes);

void bvh_refit(benchmark::State& state) {
  const StageFixture scene(drift(state.range(0)));
  Bvh tree;
  ThreadPool pool(1);
  tree.build(scene.moving, scene.state.bounds.data(), pool);
  for (auto _ : state) tree.refit(scene.state.bounds.data(), pool);
  count_boxes(state);
}
BENCHMARK(bvh_refit)->Apply(sizes);

void bvh_overlap(benchmark::State& state) {  // every box queries once
  const StageFixture scene(drift(state.range(0)));
  Bvh tree;
  ThreadPool pool(1);
  tree.build(scene.moving, scene.state.bounds.data(), pool);
  std::vector<std::uint32_t> found;
  for (auto _ : state)
    for (const std::uint32_t slot : scene.moving) {
      found.clear();
      tree.overlap(scene.state.bounds[slot].fat_box, found);
      benchmark::DoNotOptimize(found.data());
    }
  count_boxes(state);
}
BENCHMARK(bvh_overlap)->Apply(sizes);

/// Moves all boxes a little, back and forth from call to call, as a step does.
class Mover {
 public:
  explicit Mover(StageFixture& scene) : scene_(scene) {
    Random random(9);
    for (std::size_t i = 0; i < scene.moving.size(); ++i) {
      const auto x = static_cast<float>(random.symmetric(0.02));
      shifts_.push_back({x, -x, 0.5f * x});
    }
  }
  void operator()() {
    for (std::size_t i = 0; i < shifts_.size(); ++i) {
      Aabb& box = scene_.state.bounds[scene_.moving[i]].fat_box;
      box = {box.lower + sign_ * shifts_[i], box.upper + sign_ * shifts_[i]};
    }
    sign_ = -sign_;
  }

 private:
  StageFixture& scene_;
  std::vector<Vec3> shifts_;
  float sign_ = 1;
};

// A step in which every box has moved, the worst case: updates the structure, then finds all pairs.
void find_all(benchmark::State& state, std::unique_ptr<BroadPhase> (*make)()) {
  StageFixture scene(drift(state.range(0)));
  Mover move(scene);
  const std::unique_ptr<BroadPhase> broad_phase = make();
  std::vector<std::vector<Pair>> found;
  broad_phase->find(scene.input(true), scene.pool, found);
  std::size_t pairs = 0;
  for (auto _ : state) {
    state.PauseTiming();
    move();
    state.ResumeTiming();
    found.resize(broad_phase->find(scene.input(false), scene.pool, found));
  }
  for (const std::vector<Pair>& list : found) pairs += list.size();
  state.counters["pairs"] = static_cast<double>(pairs);
  count_boxes(state);
}

std::unique_ptr<BroadPhase> make_sweep() { return make_sweep_broad_phase(WorldDef{}.sweep_axis); }

BENCHMARK_CAPTURE(find_all, tree, make_tree_broad_phase)->Apply(sizes);
BENCHMARK_CAPTURE(find_all, sweep, make_sweep)->Apply(sizes);

// Projection and sorting alone: insertion sort of last step's sorted list, or sorting from scratch.
void sweep_sort(benchmark::State& state, bool from_nothing) {
  StageFixture scene(drift(state.range(0)));
  Mover move(scene);
  ThreadPool pool(1);
  const std::unique_ptr<BroadPhase> broad_phase = make_sweep();
  broad_phase->refresh(scene.input(true), pool);
  for (auto _ : state) {
    state.PauseTiming();
    move();
    state.ResumeTiming();
    broad_phase->refresh(scene.input(from_nothing), pool);
  }
  count_boxes(state);
}
BENCHMARK_CAPTURE(sweep_sort, almost_sorted, false)->Apply(sizes);
BENCHMARK_CAPTURE(sweep_sort, from_nothing, true)->Apply(sizes);

}  // namespace
}  // namespace fathom::native
