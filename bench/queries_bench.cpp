// Queries of 10,000 bodies: a cloud of cubes (the published `drift`), and cubes and hulls in layers on a ground; and a
// sea bed, a mesh of 1,000,000 triangles with 1,000 bodies on it.
//
// FATHOM_BENCH_DEVICE names the device (the default is the host), FATHOM_BENCH_THREADS the number of threads (1).
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdlib>
#include <fathom/mesh.hpp>
#include <fathom/world.hpp>
#include <random>
#include <vector>

namespace fathom {
namespace {

constexpr int body_count = 10000;
constexpr std::size_t ray_count = 1 << 16;

/// Half the side (m) of the region with the bodies.
constexpr float reach = 43.0f;

float uniform(std::mt19937& random, float low, float high) {
  return low + (high - low) * (static_cast<float>(random() >> 8) * 0x1p-24f);
}
Vec3 in_cube(std::mt19937& random) {
  const float x = uniform(random, -1, 1), y = uniform(random, -1, 1), z = uniform(random, -1, 1);
  return {x, y, z};
}
Quat any_rotation(std::mt19937& random) {
  const Vec3 v = in_cube(random);
  return normalize(Quat{uniform(random, -1, 1), v.x, v.y, v.z});
}

Shape pebble(std::mt19937& random) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 20; ++i) corners.push_back(0.5f * normalize(in_cube(random)));
  return hull(corners);
}

WorldDef definition(SimulatorKind kind) {
  WorldDef def;
  def.simulator = kind;
  const char *const device = std::getenv("FATHOM_BENCH_DEVICE"), *const threads = std::getenv("FATHOM_BENCH_THREADS");
  def.device = device ? device : "host";
  def.threads = threads ? std::atoi(threads) : 1;
  return def;
}

World cloud(SimulatorKind kind) {
  World world(definition(kind));
  std::mt19937 random(1);
  for (int i = 0; i < body_count; ++i)
    world.add({.pose = {reach * in_cube(random), 0, any_rotation(random)}, .shape = box({0.5f, 0.5f, 0.5f})});
  return world;
}

World layers(SimulatorKind kind) {
  World world(definition(kind));
  std::mt19937 random(1);
  world.add({.motion = MotionType::fixed, .shape = box({500, 500, 0.5f})});
  const Shape stone = pebble(random), cube = box({0.5f, 0.5f, 0.5f});
  for (int i = 0; i < body_count; ++i) {
    const int column = i % 2500, layer = i / 2500;
    const Vec3 at{1.1f * static_cast<float>(column % 50 - 25), 1.1f * static_cast<float>(column / 50 - 25),
                  1.0f + 1.1f * static_cast<float>(layer)};
    world.add({.pose = {at, 0, {}}, .shape = i % 2 ? stone : cube});
  }
  return world;
}

World sea_bed(SimulatorKind kind) {
  constexpr int cells = 707;
  constexpr float half = 1.4f * reach, cell = 2 * half / cells;
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> indices;
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i) {
      const float x = static_cast<float>(i) * cell - half, y = static_cast<float>(j) * cell - half;
      vertices.push_back({x, y, 3 * std::sin(0.13f * x) * std::cos(0.11f * y) + 0.3f * std::sin(1.7f * x + 2.1f * y)});
    }
  for (std::uint32_t j = 0; j < cells; ++j)
    for (std::uint32_t i = 0; i < cells; ++i) {
      const std::uint32_t a = j * (cells + 1) + i, b = a + cells + 1;
      indices.insert(indices.end(), {a, a + 1, b + 1, a, b + 1, b});
    }
  World world(definition(kind));
  world.add({.motion = MotionType::fixed, .shape = mesh(vertices, indices)});
  std::mt19937 random(1);
  for (int i = 0; i < 1000; ++i) {
    Vec3 at = reach * in_cube(random);
    at.z = uniform(random, 1, 5);
    world.add({.pose = {at, 0, any_rotation(random)}, .shape = i % 2 ? pebble(random) : box({0.5f, 0.5f, 0.5f})});
  }
  return world;
}

std::vector<Ray> rays(float length, std::size_t count = ray_count) {
  std::mt19937 random(2);
  std::vector<Ray> all;
  for (std::size_t i = 0; i < count; ++i)
    all.push_back({0.7f * reach * in_cube(random), length * normalize(in_cube(random))});
  return all;
}

using MakeWorld = World (*)(SimulatorKind);

/// Calls ask(world, ray) for one ray after the other.
template <class Ask>
void ask_of_each(benchmark::State& state, MakeWorld make, const Ask& ask) {
  const World world = make(SimulatorKind::native);
  const std::vector<Ray> all = rays(static_cast<float>(state.range(0)));
  std::size_t next = 0, met = 0;
  for (auto _ : state) met += ask(world, all[next++ % all.size()]);
  state.counters["met"] = static_cast<double>(met) / static_cast<double>(state.iterations());
}

void cast_rays(benchmark::State& state, MakeWorld make, SimulatorKind kind) {
  const World world = make(kind);
  const std::vector<Ray> all = rays(static_cast<float>(state.range(0)));
  std::vector<std::optional<CastHit>> hits(all.size());
  for (auto _ : state) world.cast_rays(all, hits);
  std::size_t met = 0;
  for (const auto& hit : hits) met += hit.has_value();
  state.counters["met"] = static_cast<double>(met) / static_cast<double>(hits.size());
  state.SetItemsProcessed(static_cast<std::int64_t>(all.size() * state.iterations()));
}
BENCHMARK_CAPTURE(cast_rays, cloud, cloud, SimulatorKind::native)->Arg(10)->Arg(100);
BENCHMARK_CAPTURE(cast_rays, cloud_device, cloud, SimulatorKind::device)->Arg(100);
BENCHMARK_CAPTURE(cast_rays, layers, layers, SimulatorKind::native)->Arg(10)->Arg(100);

/// As many rays as the argument says, of 100 m, each time after a step.
void cast_after_a_step(benchmark::State& state, MakeWorld make, SimulatorKind kind) {
  World world = make(kind);
  const std::vector<Ray> all = rays(100, static_cast<std::size_t>(state.range(0)));
  std::vector<std::optional<CastHit>> hits(all.size());
  std::size_t met = 0;
  for (auto _ : state) {
    state.PauseTiming();
    world.step();
    world.wait();
    state.ResumeTiming();
    world.cast_rays(all, hits);
  }
  for (const auto& hit : hits) met += hit.has_value();
  state.counters["met"] = static_cast<double>(met) / static_cast<double>(hits.size());
  state.SetItemsProcessed(static_cast<std::int64_t>(all.size() * state.iterations()));
}
constexpr std::int64_t million = 1'000'000;
BENCHMARK_CAPTURE(cast_after_a_step, cloud, cloud, SimulatorKind::native)->Arg(256)->Arg(2048)->Arg(million);
BENCHMARK_CAPTURE(cast_after_a_step, cloud_device, cloud, SimulatorKind::device)->Arg(256)->Arg(2048)->Arg(million);
BENCHMARK_CAPTURE(cast_after_a_step, layers, layers, SimulatorKind::native)->Arg(2048)->Arg(million);
BENCHMARK_CAPTURE(cast_after_a_step, layers_device, layers, SimulatorKind::device)->Arg(2048)->Arg(million);
BENCHMARK_CAPTURE(cast_after_a_step, sea_bed, sea_bed, SimulatorKind::native)->Arg(2048)->Arg(million);
BENCHMARK_CAPTURE(cast_after_a_step, sea_bed_device, sea_bed, SimulatorKind::device)->Arg(2048)->Arg(million);

void cast_ray_all(benchmark::State& state, MakeWorld make) {
  ask_of_each(state, make, [](const World& world, const Ray& ray) {
    return world.cast_ray_all(ray.origin, ray.translation).size();
  });
}
BENCHMARK_CAPTURE(cast_ray_all, cloud, cloud)->Arg(100);

void cast_shape(benchmark::State& state, MakeWorld make, const Shape& shape) {
  ask_of_each(state, make, [&](const World& world, const Ray& ray) {
    return world.cast_shape(shape, {ray.origin, 0, {}}, ray.translation).has_value();
  });
}
BENCHMARK_CAPTURE(cast_shape, sphere_in_cloud, cloud, sphere(0.5f))->Arg(10)->Arg(100);
BENCHMARK_CAPTURE(cast_shape, capsule_in_cloud, cloud, capsule(0.3f, 0.6f))->Arg(10);
BENCHMARK_CAPTURE(cast_shape, box_in_cloud, cloud, box({0.5f, 0.5f, 0.5f}))->Arg(10);
BENCHMARK_CAPTURE(cast_shape, sphere_over_layers, layers, sphere(0.5f))->Arg(10);

void cast_shapes(benchmark::State& state, MakeWorld make, const Shape& shape) {
  const World world = make(SimulatorKind::native);
  std::vector<ShapeCast> all;
  for (const Ray& ray : rays(static_cast<float>(state.range(0))))
    all.push_back({&shape, {ray.origin, 0, {}}, ray.translation});
  std::vector<std::optional<CastHit>> hits(all.size());
  for (auto _ : state) world.cast_shapes(all, hits);
  state.SetItemsProcessed(static_cast<std::int64_t>(all.size() * state.iterations()));
}
BENCHMARK_CAPTURE(cast_shapes, sphere_in_cloud, cloud, sphere(0.5f))->Arg(10);

/// Balls, capsules, boxes and hulls of about a metre, turned at random; they move by `length` (m).
class Casts {
 public:
  Casts(float length, std::size_t count) {
    std::mt19937 random(4);
    shapes_ = {sphere(0.5f), capsule(0.3f, 0.6f), box({0.5f, 0.4f, 0.3f}), pebble(random)};
    for (const Ray& ray : rays(length, count))
      all_.push_back({&shapes_[all_.size() % shapes_.size()], {ray.origin, 0, any_rotation(random)}, ray.translation});
  }
  const std::vector<ShapeCast>& all() const { return all_; }

 private:
  std::vector<Shape> shapes_;
  std::vector<ShapeCast> all_;
};

/// Calls ask(world) for as many shapes as the argument says, each time after a step.
template <class Ask>
void ask_after_a_step(benchmark::State& state, World world, const Ask& ask) {
  for (auto _ : state) {
    state.PauseTiming();
    world.step();
    world.wait();
    state.ResumeTiming();
    ask(world);
  }
  state.SetItemsProcessed(state.range(0) * static_cast<std::int64_t>(state.iterations()));
}

/// Moved by 10 m.
void cast_shapes_after_a_step(benchmark::State& state, MakeWorld make, SimulatorKind kind) {
  const Casts casts(10, static_cast<std::size_t>(state.range(0)));
  std::vector<std::optional<CastHit>> hits(casts.all().size());
  ask_after_a_step(state, make(kind), [&](const World& world) { world.cast_shapes(casts.all(), hits); });
  std::size_t met = 0;
  for (const auto& hit : hits) met += hit.has_value();
  state.counters["met"] = static_cast<double>(met) / static_cast<double>(hits.size());
}
void overlap_shapes_after_a_step(benchmark::State& state, MakeWorld make, SimulatorKind kind) {
  const Casts casts(10, static_cast<std::size_t>(state.range(0)));
  std::vector<std::vector<BodyId>> found(casts.all().size());
  ask_after_a_step(state, make(kind), [&](const World& world) { world.overlap_shapes(casts.all(), found); });
  std::size_t met = 0;
  for (const auto& list : found) met += list.size();
  state.counters["met"] = static_cast<double>(met) / static_cast<double>(found.size());
}
constexpr std::int64_t many = 100'000;
BENCHMARK_CAPTURE(cast_shapes_after_a_step, cloud, cloud, SimulatorKind::native)->Arg(2048)->Arg(many);
BENCHMARK_CAPTURE(cast_shapes_after_a_step, cloud_device, cloud, SimulatorKind::device)->Arg(2048)->Arg(many);
BENCHMARK_CAPTURE(cast_shapes_after_a_step, layers, layers, SimulatorKind::native)->Arg(2048)->Arg(many);
BENCHMARK_CAPTURE(cast_shapes_after_a_step, layers_device, layers, SimulatorKind::device)->Arg(2048)->Arg(many);
BENCHMARK_CAPTURE(cast_shapes_after_a_step, sea_bed, sea_bed, SimulatorKind::native)->Arg(2048)->Arg(many);
BENCHMARK_CAPTURE(cast_shapes_after_a_step, sea_bed_device, sea_bed, SimulatorKind::device)->Arg(2048)->Arg(many);
BENCHMARK_CAPTURE(overlap_shapes_after_a_step, cloud, cloud, SimulatorKind::native)->Arg(2048)->Arg(many);
BENCHMARK_CAPTURE(overlap_shapes_after_a_step, cloud_device, cloud, SimulatorKind::device)->Arg(2048)->Arg(many);
BENCHMARK_CAPTURE(overlap_shapes_after_a_step, layers, layers, SimulatorKind::native)->Arg(2048)->Arg(many);
BENCHMARK_CAPTURE(overlap_shapes_after_a_step, layers_device, layers, SimulatorKind::device)->Arg(2048)->Arg(many);
BENCHMARK_CAPTURE(overlap_shapes_after_a_step, sea_bed, sea_bed, SimulatorKind::native)->Arg(2048)->Arg(many);
BENCHMARK_CAPTURE(overlap_shapes_after_a_step, sea_bed_device, sea_bed, SimulatorKind::device)->Arg(2048)->Arg(many);

void overlap_shape(benchmark::State& state, MakeWorld make, const Shape& shape) {
  ask_of_each(state, make, [&](const World& world, const Ray& ray) {
    return world.overlap_shape(shape, {ray.origin, 0, {}}).size();
  });
}
BENCHMARK_CAPTURE(overlap_shape, sphere_in_cloud, cloud, sphere(2))->Arg(10);

// Extra cost of the first query after a step: all bodies have moved.
void first_after_a_change(benchmark::State& state, SimulatorKind kind) {
  World world = cloud(kind);
  const BodyId moved = world.bodies()[0];
  for (auto _ : state) {
    world.set_pose(moved, world.pose(moved));
    benchmark::DoNotOptimize(world.overlap_aabb({{1000, 0, 0}, {1001, 1, 1}}));
  }
}
BENCHMARK_CAPTURE(first_after_a_change, native, SimulatorKind::native);
BENCHMARK_CAPTURE(first_after_a_change, device, SimulatorKind::device);

/// A step of the drifting cloud with as many sensors as bodies: balls of 2 m.
void step_with_sensors(benchmark::State& state, SimulatorKind kind) {
  World world = cloud(kind);
  world.set_gravity({});
  std::mt19937 random(3);
  for (const BodyId id : world.bodies()) world.set_velocity(id, in_cube(random), in_cube(random));
  for (int i = 0; i < state.range(0); ++i)
    world.add({.motion = MotionType::fixed,
               .pose = {0.7f * reach * in_cube(random), 0, {}},
               .shape = sphere(2),
               .sensor = true});
  for (auto _ : state) {
    world.step();
    benchmark::DoNotOptimize(world.sensor_begun().size());
  }
}
BENCHMARK_CAPTURE(step_with_sensors, native, SimulatorKind::native)->Arg(0)->Arg(1)->Arg(100)->Arg(1000);

}  // namespace
}  // namespace fathom
