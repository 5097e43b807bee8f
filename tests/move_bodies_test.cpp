// Moving bodies in vector lanes, against the functions for one body.
#include "native/move_bodies.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "dynamics/rotation.hpp"
#include "world_fixture.hpp"

namespace fathom::native::move_bodies_test {
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
    ASSERT_EQ(move_bodies<false>(slots, bodies, state, {{0, 0, -9.81f}, dt, 4, {1000}}), 0u);
    for (const std::uint32_t slot : slots) {
      const BodyBounds& now = state.bounds[slot];
      const Velocity& velocity = state.velocities[slot];
      const BodyBounds anew = bounds_of(bodies[slot], state.poses[slot], velocity, dt);
      // Extents of boxes are summed in a different order than in `bounds`.
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

/// A flight of one body by the laws of dynamics/, which each lane must reproduce.
struct Flown {
  Pose pose;
  Velocity velocity;
};
Flown flown(const BodyInfo& info, const Pose& begin, const Velocity& v, const Force& force, const MoveParameters& p) {
  const float h = p.dt / static_cast<float>(p.substeps);
  Acceleration a{info.gravity_scale * p.gravity, {}};
  const bool forced = !(force.force == Vec3{} && force.torque == Vec3{});
  if (forced) a = forced_acceleration(info, begin.rotation, force, a.linear);
  const FlightForces<Vec3> by{a.linear, a.angular, damping_factor(info.linear_damping, h),
                              damping_factor(info.angular_damping, h)};
  Flight<Vec3> f{v.linear, v.angular, {v.reserved0, v.reserved1, begin.reserved}, {}, {}};
  fly(f, by, p.dt, p.substeps, p.limits.angular);
  Vec3 left;
  if (forced)
    complete_forced(f.moved, info.isotropic ? f.turned : left, force, a, v.linear, f.linear, v.angular, f.angular, true,
                    p.dt, static_cast<float>(p.substeps));
  Flown to{begin, {limited(f.linear, p.limits.linear), 0, limited(f.angular, p.limits.angular), 0}};
  if (length(f.moved) > 1.01f * p.dt * p.limits.linear) f.moved = limited(f.moved, p.dt * p.limits.linear);
  to.pose.position = begin.position + f.moved;
  if (info.isotropic) {
    to.pose.rotation = turned(begin.rotation, f.turned);
    return to;
  }
  to.velocity.angular = v.angular;
  spin_freely(to.pose.rotation, to.velocity.angular, by.angular_acceleration, by.angular_damping, info.inertia,
              info.inverse_inertia, h, p.substeps, p.limits.angular);
  to.velocity.angular = limited(to.velocity.angular, p.limits.angular);
  if (length_squared(left) > 0) to.pose.rotation = turned(to.pose.rotation, left);
  return to;
}

// Every kind of body beside every other in the lanes: still ones, ones at and beyond the limits, spins of many turns
// per step, damped, forced, with all kinds of inertia.
TEST(MoveBodies, EveryLaneFliesAsOneBody) {
  std::mt19937 random(8);
  const auto uniform = [&](float lo, float hi) {
    return lo + (hi - lo) * static_cast<float>(random() >> 8) / 16777216.0f;
  };
  const auto vector = [&](float size) {
    return Vec3{uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  };
  for (const float dt : {1.0f / 30, 1.0f / 60, 1.0f / 240}) {
    const int substeps = 1 + static_cast<int>(random() % 8);
    BodyTable bodies;
    BodyState state;
    std::vector<std::uint32_t> slots;
    for (int i = 0; i < 500; ++i) {
      BodyDef def = test::cube(vector(100));
      if (i % 3 == 1) def.shape = sphere(uniform(0.01f, 2));
      if (i % 3 == 2) def.shape = box({uniform(0.01f, 2), uniform(0.01f, 2), uniform(0.01f, 2)});
      def.mass = std::exp(uniform(-5, 8));
      def.pose.rotation = normalize(Quat{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)});
      if (i % 4 == 1) def.linear_damping = uniform(0, 5);
      if (i % 7 == 1) def.angular_damping = uniform(0, 5);
      const std::uint32_t slot = bodies.add(def).index;
      state.resize(slot + 1);
      state.clear(slot);
      state.poses[slot] = def.pose;
      state.velocities[slot] = {vector(i % 5 == 0 ? 900.0f : std::exp(uniform(-12, 4))), 0,
                                vector(std::exp(uniform(-12, 9))), 0};
      state.flight[slot] = flight_data(bodies[slot]);
      state.flags[slot] = awake;
      if (i % 6 == 1) {
        state.flags[slot] |= has_force;
        state.forces[slot] = {vector(std::exp(uniform(-5, 12))),
                              i % 12 == 1 ? vector(std::exp(uniform(-5, 6))) : Vec3{}};
      }
      state.bounds[slot] = bounds_of(bodies[slot], def.pose, state.velocities[slot], dt);
      slots.push_back(slot);
    }
    MoveParameters p{{0, 0, -9.81f}, dt, substeps, speed_limits(1000, dt / static_cast<float>(substeps))};
    p.forced = true;
    const BodyState before = state;
    ASSERT_EQ(move_bodies<false>(slots, bodies, state, p), 0u);
    for (const std::uint32_t slot : slots) {
      const Force force = before.flags[slot] & has_force ? before.forces[slot] : Force{};
      const Flown one = flown(bodies[slot], before.poses[slot], before.velocities[slot], force, p);
      // Hamilton products round differently in lanes; everything else is the same.
      EXPECT_EQ(state.poses[slot].position, one.pose.position) << slot;
      EXPECT_EQ(state.velocities[slot].linear, one.velocity.linear) << slot;
      EXPECT_EQ(state.velocities[slot].angular, one.velocity.angular) << slot;
      const Quat q = state.poses[slot].rotation, r = one.pose.rotation;
      EXPECT_NEAR(abs(dot(q, r)), 1, 1e-6f) << slot;
      EXPECT_NEAR(q.w * dot(q, r), r.w, 2e-6f) << slot;
    }
  }
}

}  // namespace
}  // namespace fathom::native::move_bodies_test
