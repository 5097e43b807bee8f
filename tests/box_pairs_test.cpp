// Separating-axis tests of boxes in vector lanes, against the same pairs one by one.
#include "native/box_pairs.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <random>

#include "collision/box_box.hpp"
#include "dynamics/manifold_update.hpp"

namespace fathom::native::box_pairs_test {
namespace {

struct Bodies {
  BodyState state;
  std::mt19937 random{17};

  std::uint32_t below(std::uint32_t end) { return static_cast<std::uint32_t>(random()) % end; }
  float uniform(float lo, float hi) { return lo + (hi - lo) * static_cast<float>(random() >> 8) / 16777216.0f; }
  Vec3 vector(float size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }

  /// A box near all the others, sometimes aligned with the world.
  void add() {
    const auto slot = static_cast<std::uint32_t>(state.size());
    state.resize(slot + 1);
    Pose& pose = state.poses[slot];
    pose.position = Vec3{100, -20, 3} + vector(0.9f);
    const Vec3 axis = vector(1);
    if (below(4) != 0) pose.rotation = normalize(Quat{uniform(-1, 1), axis.x, axis.y, axis.z});
    state.velocities[slot].linear = vector(3);
    state.velocities[slot].angular = vector(5);
    state.bounds[slot].half_extents = {uniform(0.05f, 0.6f), uniform(0.05f, 0.6f), uniform(0.05f, 0.6f)};
    state.bounds[slot].radius = length(state.bounds[slot].half_extents);
  }
};

std::uint32_t as_number(AxisCache cache) { return std::bit_cast<std::uint32_t>(cache); }

TEST(BoxPairs, AreSeparatedAsOneByOne) {
  Bodies bodies;
  for (int i = 0; i < 400; ++i) bodies.add();
  const BodyState& state = bodies.state;
  constexpr float dt = 1.0f / 60;
  std::size_t separated = 0, by_edges = 0, all = 0;
  for (int round = 0; round < 2000; ++round) {
    BoxPairs pairs;
    pairs.count = 1 + bodies.below(BoxPairs::most);
    AxisCache before[BoxPairs::most], caches[BoxPairs::most];
    for (std::size_t i = 0; i < pairs.count; ++i) {
      pairs.a[i] = bodies.below(400);
      pairs.b[i] = (pairs.a[i] + 1 + bodies.below(399)) % 400;
      const auto kind = static_cast<AxisCache::Kind>(bodies.below(4));
      caches[i] = before[i] =
          make_cache(kind, static_cast<int>(bodies.below(3)), static_cast<int>(bodies.below(3)), bodies.below(2));
    }
    Pose b_in_a[BoxPairs::most];
    const std::uint32_t apart = separate_boxes(pairs, dt, state, b_in_a, caches);
    for (std::size_t i = 0; i < pairs.count; ++i) {
      const std::uint32_t a = pairs.a[i], b = pairs.b[i];
      const BodyBounds &x = state.bounds[a], &y = state.bounds[b];
      const Pose expected = relative(state.poses[a], state.poses[b]);
      ASSERT_EQ(expected.position, b_in_a[i].position);
      ASSERT_TRUE(expected.rotation.w == b_in_a[i].rotation.w &&
                  expected.rotation.vector() == b_in_a[i].rotation.vector());
      const float margin = speculative_margin(x.radius, y.radius, state.velocities[a], state.velocities[b], dt);
      AxisCache cache = before[i];
      const Manifold manifold = collide_boxes(x.half_extents, y.half_extents, expected, margin, cache);
      const bool is_apart = manifold.count == 0 && cache.separated;
      ASSERT_EQ(apart >> i & 1, is_apart ? 1u : 0u);
      ASSERT_EQ(as_number(caches[i]), as_number(is_apart ? cache : before[i]));
      ++all;
      separated += is_apart;
      by_edges += is_apart && cache.kind == AxisCache::edges;
    }
    EXPECT_EQ(apart >> (pairs.count - 1) >> 1, 0u);
  }
  EXPECT_GT(separated, all / 5);
  EXPECT_LT(separated, all / 5 * 4);
  EXPECT_GT(by_edges, all / 40);
}

}  // namespace
}  // namespace fathom::native::box_pairs_test
