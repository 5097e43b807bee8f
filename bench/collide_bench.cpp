// Contact manifolds, one pair of shapes at a time, and building hulls. Time is per pair.
#include <benchmark/benchmark.h>

#include <array>

#include "collision/manifold.hpp"
#include "scene/random.hpp"

namespace fathom {
namespace {

constexpr float margin = 0.02f;        // the speculative margin of bodies at rest
constexpr std::size_t variants = 256;  // poses near the case's own: too many for branch prediction to learn

Vec3 random_vector(Random& random, float limit) {
  const auto x = static_cast<float>(random.symmetric(limit));
  const auto y = static_cast<float>(random.symmetric(limit));
  const auto z = static_cast<float>(random.symmetric(limit));
  return {x, y, z};
}

Vec3 random_direction(Random& random) {
  for (;;) {
    const Vec3 v = random_vector(random, 1);
    if (length(v) > 0.1f && length(v) <= 1) return normalize(v);
  }
}

Shape round_hull(int points) {
  Random random(5);
  std::vector<Vec3> cloud;
  for (int i = 0; i < points; ++i) cloud.push_back(0.5f * random_direction(random));
  return hull(cloud);
}

Shape cube() { return box({0.5f, 0.5f, 0.5f}); }

// Poses of B in A's frame.
Pose above(float height) { return {{0.1f, 0.05f, height}, 0, {}}; }
// B on one of its edges, which lies across an edge of A.
Pose edge_across_edge() {
  const Quat up = normalize(Quat{0.9239f, 0.3827f, 0, 0}), across = normalize(Quat{0.9239f, 0, 0.3827f, 0});
  return {rotate(across, {0, 0, 1.40f}), 0, across * up};
}

void pair(benchmark::State& state, const Shape& a, const Shape& b, const Pose& b_in_a, bool remember = true) {
  Random random(3);
  std::array<Pose, variants> poses;
  for (Pose& pose : poses) {
    const Vec3 turn = random_vector(random, 0.001f);
    pose = {b_in_a.position + random_vector(random, 0.002f), 0,
            normalize(b_in_a.rotation * Quat{1, turn.x, turn.y, turn.z})};
  }
  std::array<AxisCache, variants> caches{};
  const Geometry ga = geometry(a), gb = geometry(b);
  std::size_t i = 0;
  std::int64_t points = 0;
  for (auto _ : state) {
    if (!remember) caches[i] = {};
    const Manifold manifold = collide(ga, gb, poses[i], margin, caches[i]);
    points += manifold.count;
    i = (i + 1) % variants;
  }
  state.counters["points"] = static_cast<double>(points) / static_cast<double>(state.iterations());
}

BENCHMARK_CAPTURE(pair, box_box_face, cube(), cube(), above(0.995f));
BENCHMARK_CAPTURE(pair, box_box_face_first_time, cube(), cube(), above(0.995f), false);
BENCHMARK_CAPTURE(pair, box_box_edges, cube(), cube(), edge_across_edge());
BENCHMARK_CAPTURE(pair, box_box_separated, cube(), cube(), above(1.1f));
BENCHMARK_CAPTURE(pair, box_box_separated_first_time, cube(), cube(), above(1.1f), false);
BENCHMARK_CAPTURE(pair, ground_box, box({500, 500, 0.5f}), cube(), above(0.998f));
BENCHMARK_CAPTURE(pair, sphere_sphere, sphere(0.5f), sphere(0.5f), above(0.98f));
BENCHMARK_CAPTURE(pair, sphere_capsule, sphere(0.5f), capsule(0.3f, 0.4f), above(1.19f));
BENCHMARK_CAPTURE(pair, capsule_capsule, capsule(0.3f, 0.4f), capsule(0.3f, 0.4f), above(1.39f));
BENCHMARK_CAPTURE(pair, box_sphere, cube(), sphere(0.5f), above(0.995f));
BENCHMARK_CAPTURE(pair, box_capsule, cube(), capsule(0.3f, 0.4f), above(1.195f));
BENCHMARK_CAPTURE(pair, hull_sphere, round_hull(32), sphere(0.5f), above(0.97f));
BENCHMARK_CAPTURE(pair, box_hull, cube(), round_hull(32), above(0.97f));
BENCHMARK_CAPTURE(pair, hull_hull_12_points, round_hull(12), round_hull(12), above(0.85f));
BENCHMARK_CAPTURE(pair, hull_hull_32_points, round_hull(32), round_hull(32), above(0.95f));
BENCHMARK_CAPTURE(pair, hull_hull_32_points_first_time, round_hull(32), round_hull(32), above(0.95f), false);
BENCHMARK_CAPTURE(pair, hull_hull_100_points, round_hull(100), round_hull(100), above(0.97f));

void hull_of_sphere_points(benchmark::State& state) {
  Random random(5);
  std::vector<Vec3> cloud;
  for (std::int64_t i = 0; i < state.range(0); ++i) cloud.push_back(random_direction(random));
  for (auto _ : state) benchmark::DoNotOptimize(hull(cloud));
}
BENCHMARK(hull_of_sphere_points)->Arg(8)->Arg(32)->Arg(100)->Unit(benchmark::kMicrosecond);

void hull_of_cube_points(benchmark::State& state) {  // most points are inside
  Random random(5);
  std::vector<Vec3> cloud;
  for (std::int64_t i = 0; i < state.range(0); ++i) cloud.push_back(random_vector(random, 1));
  for (auto _ : state) benchmark::DoNotOptimize(hull(cloud));
}
BENCHMARK(hull_of_cube_points)->Arg(100)->Arg(1000)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace fathom
