// Manifolds and the contact solver on a pyramid of 15 layers: every kernel for every instruction set that this machine
// supports, on one thread. Compare the counters `per_…`.
#include <benchmark/benchmark.h>

#include <cstring>
#include <string>

#include "native/solver.hpp"
#include "stage_fixture.hpp"

namespace fathom::native {
namespace {

constexpr std::int64_t pyramid_size = 15;

/// Seconds for each of the `items` that an iteration processes.
benchmark::Counter per(std::size_t items) {
  return {static_cast<double>(items), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert};
}

void narrow_phase(benchmark::State& state, bool recycled) {
  StageFixture scene(pyramid(pyramid_size));
  scene.make_contacts();
  std::vector<NewManifold> begun;
  for (auto _ : state)
    for (std::uint32_t i = 0; i < scene.graph.size(); ++i) {
      // A manifold made at other poses must be rebuilt.
      if (!recycled && scene.graph[i].touching()) scene.graph.manifold(scene.graph[i]).forget_build();
      scene.update(i, begun);
    }
  state.counters["pairs"] = static_cast<double>(scene.graph.size());
  state.counters["per_pair"] = per(scene.graph.size());
}
BENCHMARK_CAPTURE(narrow_phase, made_anew, false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(narrow_phase, recycled, true)->Unit(benchmark::kMicrosecond);

/// The pyramid's contacts as blocks of one width, colour by colour.
class Blocks {
 public:
  explicit Blocks(const SolverKernels& kernels)
      : kernels_(kernels), scene_(pyramid(pyramid_size)), graph_(scene_.graph) {
    scene_.make_contacts();
    ContactSolver solver(scene_.scene.world, scene_.bodies, scene_.joints, scene_.state, graph_, scene_.pool);
    solver.lay_out({scene_.moving, 1}, {}, 1);
    solver.build();
    const float h = scene_.scene.world.dt / 4;
    for (const std::uint32_t slot : scene_.moving)
      scene_.state.solver_bodies()[slot].linear = h * scene_.scene.world.gravity;
    at_start_ = scene_.state.solver;
    lay_out();
    soft_.inverse_substep = 1 / h;
    soft_.contacts.dynamic = make_soft(30, 1, h);
    soft_.contacts.fixed = make_soft(60, 1, h);
    soft_.push_out_velocity = 3;
    soft_.restitution_threshold = 1;
    prepare();
  }

  std::size_t manifolds() const { return scene_.manifold_count; }
  Constrained constrained() {
    graph_.make_room_for_touches();
    Constrained all = graph_.constrained();
    all.touches = {&graph_.touch_changes(),
                   scene_.state.poses.data(),
                   scene_.state.velocities.data(),
                   scene_.state.solver_bodies(),
                   1,
                   scene_.scene.world.dt};
    return all;
  }

  void prepare() {
    BodiesView view;
    view.poses = scene_.state.poses.data(), view.bodies = scene_.state.solver_bodies();
    view.inertias = scene_.state.inertia.data();
    kernels_.prepare(array_, 0, stretches_.back(), lanes_.data(), constrained(), view);
  }
  void warm_start() {
    for_each_colour([&](std::size_t begin, std::size_t end) {
      kernels_.warm_start(array_, begin, end, scene_.state.solver_bodies());
    });
  }
  void solve() { sweep(kernels_.solve); }
  void relax() { sweep(kernels_.relax); }
  void iterate() { sweep(kernels_.iterate); }
  void store() { kernels_.store(array_, 0, stretches_.back(), lanes_.data(), constrained(), 1, {}); }

  /// Otherwise endlessly repeated sweeps would end in denormals.
  void reset_bodies() {
    std::memcpy(scene_.state.solver.data(), at_start_.data(), at_start_.size() * sizeof(SolverBody));
  }

 private:
  void lay_out() {
    const auto width = static_cast<std::size_t>(kernels_.width);
    for (int colour = 0; colour < colour_count; ++colour) {
      const std::vector<std::uint32_t>& contacts = graph_.of(0, colour);
      lanes_.insert(lanes_.end(), contacts.begin(), contacts.end());
      lanes_.resize((lanes_.size() + width - 1) / width * width, none);
      stretches_.push_back(lanes_.size() / width);
    }
    constexpr std::size_t alignment = 64;
    array_.stride = kernels_.isotropic_block_bytes;  // a pyramid of cubes
    memory_.resize(stretches_.back() * array_.stride + alignment);
    const std::size_t off = reinterpret_cast<std::uintptr_t>(memory_.data()) % alignment;
    array_.blocks = memory_.data() + (alignment - off);
  }

  template <class Kernel>
  void for_each_colour(const Kernel& kernel) {
    std::size_t begin = 0;
    for (const std::size_t end : stretches_) {
      if (end > begin) kernel(begin, end);
      begin = end;
    }
  }
  template <class Pass>
  void sweep(Pass pass) {
    for_each_colour(
        [&](std::size_t begin, std::size_t end) { pass(array_, begin, end, scene_.state.solver_bodies(), soft_); });
  }

  const SolverKernels& kernels_;
  StageFixture scene_;
  ContactGraph& graph_;
  std::vector<std::uint32_t> lanes_;
  std::vector<std::size_t> stretches_;  // ends of colours, in blocks
  std::vector<std::byte> memory_;
  BlockArray array_;
  std::vector<SolverBody> at_start_;
  SweepParameters soft_;
};

void kernel(benchmark::State& state, const SolverKernels& kernels, void (Blocks::*pass)()) {
  Blocks blocks(kernels);
  for (auto _ : state) {
    state.PauseTiming();
    blocks.reset_bodies();
    state.ResumeTiming();
    (blocks.*pass)();
  }
  state.counters["manifolds"] = static_cast<double>(blocks.manifolds());
  state.counters["per_manifold"] = per(blocks.manifolds());
}

/// The machine's own choice first.
std::vector<SolverKernels> runnable_kernels() {
  std::vector<SolverKernels> list{wide_kernels()};
  for (const char* name : {"AVX3", "AVX2", "NEON", "single"})
    if (std::string(name) != list.front().name && select_kernels(name)) list.push_back(wide_kernels());
  select_kernels(nullptr);
  return list;
}

// The instruction sets are known only at run time, so the benchmarks register themselves.
[[maybe_unused]] const bool registered = [] {
  static const std::vector<SolverKernels> list = runnable_kernels();
  const std::pair<const char*, void (Blocks::*)()> passes[] = {
      {"prepare", &Blocks::prepare}, {"warm_start", &Blocks::warm_start}, {"solve", &Blocks::solve},
      {"relax", &Blocks::relax},     {"iterate", &Blocks::iterate},       {"store", &Blocks::store}};
  for (const auto& [name, pass] : passes)
    for (const SolverKernels& kernels : list)
      benchmark::RegisterBenchmark((std::string("kernel/") + name + "/" + kernels.name).c_str(), kernel, kernels, pass)
          ->Unit(benchmark::kMicrosecond);
  return true;
}();

// All substeps of a step, called as the simulator does.
void contact_solver(benchmark::State& state, Solver method) {
  StageFixture scene(pyramid(pyramid_size));
  scene.make_contacts();
  scene.scene.world.solver.method = method;
  ContactSolver solver(scene.scene.world, scene.bodies, scene.joints, scene.state, scene.graph, scene.pool);
  for (auto _ : state) {
    solver.lay_out({scene.moving, 1}, {}, 1);
    solver.build();
    solver.solve([](std::span<const std::uint32_t>) {}, [](std::span<const std::uint32_t>) {});
  }
  state.counters["per_manifold"] = per(scene.manifold_count);
}
BENCHMARK_CAPTURE(contact_solver, soft, Solver::soft)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(contact_solver, impulse, Solver::impulse)->Unit(benchmark::kMicrosecond);

// Bodies without contacts in the solver: loading them and four substeps of integration.
void integration(benchmark::State& state, Vec3 half_extents) {
  Scene made = drift(1000);
  for (BodyDef& body : made.bodies) {
    body.shape = box(half_extents);
    body.velocity = {{1, 2, 3}, 0, {0.3f, 0.2f, 0.1f}, 0};
  }
  StageFixture scene(std::move(made));
  for (const std::uint32_t slot : scene.moving) scene.state.velocities[slot] = scene.scene.bodies[slot].velocity;
  ContactSolver solver(scene.scene.world, scene.bodies, scene.joints, scene.state, scene.graph, scene.pool);
  for (auto _ : state) {
    solver.lay_out({scene.moving, 1}, {}, 1);
    solver.build();
    solver.solve([](std::span<const std::uint32_t>) {}, [](std::span<const std::uint32_t>) {});
  }
  state.counters["per_body"] = per(scene.moving.size());
}
BENCHMARK_CAPTURE(integration, cubes, Vec3{0.5f, 0.5f, 0.5f})->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(integration, slabs, Vec3{0.5f, 0.3f, 0.1f})->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace fathom::native
