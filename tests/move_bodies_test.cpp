// Boxes of bodies that moved, told in vector lanes, against the functions of one body.
#include "native/move_bodies.hpp"

#include <gtest/gtest.h>

#include <random>

#include "world_fixture.hpp"

namespace fathom::native {
namespace {

TEST(MoveBodies, BoundsAreThoseOfOneBody) {
  constexpr float dt = 1.0f / 60;
  std::mt19937 random(3);
  const auto uniform = [&](float lo, float hi) {
    return lo + (hi - lo) * static_cast<float>(random() >> 8) / 16777216.0f;
  };
  const auto vector = [&](float size) {
    return Vec3{uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  };
  BodyTable bodies;
  BodyState state;
  std::vector<std::uint32_t> slots;
  for (int i = 0; i < 203; ++i) {
    BodyDef def = test::cube(vector(20));
    if (i % 5 == 1) def.shape = sphere(uniform(0.1f, 2));
    if (i % 5 == 2) def.shape = capsule(uniform(0.1f, 1), uniform(0.1f, 1));
    if (i % 5 != 1 && i % 5 != 2) def.shape = box({uniform(0.01f, 2), uniform(0.01f, 2), uniform(0.01f, 2)});
    def.pose.rotation = normalize(Quat{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)});
    const Velocity velocity{vector(i % 3 == 0 ? 30.0f : 0.5f), 0, vector(4), 0};
    const std::uint32_t slot = bodies.add(def).index;
    state.resize(slot + 1);
    state.clear(slot);
    state.poses[slot] = def.pose;
    state.velocities[slot] = velocity;
    state.bounds[slot] = bounds_of(bodies[slot], def.pose, velocity, dt);
    state.flight[slot] = flight_data(bodies[slot]);
    state.flags[slot] = awake;
    slots.push_back(slot);
  }
  int left = 0;
  for (int step = 0; step < 5; ++step) {
    const std::vector<BodyBounds> before = state.bounds;
    for (const std::uint32_t slot : slots) state.flags[slot] = awake;
    ASSERT_EQ(move_bodies<false>(slots, bodies, state, {{0, 0, -9.81f}, dt, 4, 1000}), 0u);
    for (const std::uint32_t slot : slots) {
      const BodyBounds& now = state.bounds[slot];
      const Velocity& velocity = state.velocities[slot];
      const BodyBounds anew = bounds_of(bodies[slot], state.poses[slot], velocity, dt);
      // Extents of boxes are summed in another order than by `bounds`.
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(now.box.lower[axis], anew.box.lower[axis], 1e-5f);
        EXPECT_NEAR(now.box.upper[axis], anew.box.upper[axis], 1e-5f);
      }
      const bool leaves = !contains(before[slot].fat_box, now.box);
      left += leaves;
      EXPECT_EQ((state.flags[slot] & box_changed) != 0, leaves);
      const Aabb fat = leaves ? fat_box(bodies[slot], now.box, velocity.linear, dt) : before[slot].fat_box;
      EXPECT_EQ(now.fat_box.lower, fat.lower);
      EXPECT_EQ(now.fat_box.upper, fat.upper);
      EXPECT_EQ(now.half_extents, before[slot].half_extents);
      EXPECT_EQ(now.radius, before[slot].radius);
    }
  }
  EXPECT_GT(left, 150);
  EXPECT_LT(left, 800);
}

}  // namespace
}  // namespace fathom::native
