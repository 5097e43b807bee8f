// Controllers in the application: forces and torques that it computes once per step from what it reads.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/joint.hpp>
#include <functional>

#include "world_fixture.hpp"

namespace fathom::steering_test {
namespace {

using namespace test;

constexpr float dt = 1.0f / 60;

/// ω in units of 1 / dt: undamped oscillators for which symplectic Euler is stable, ω dt < 2.
const float all_omegas[] = {0.1f, 0.3f, 0.6f, 1.0f, 1.4f, 1.8f};

/// Symplectic Euler for x' = v, v' = −ω² x − c v, all in units of a step.
struct Reference {
  double x, v = 0;

  void step(double w, double damping) {
    v -= w * w * x + damping * v;
    x += v;
  }
};

/// The greatest distance from the origin that symplectic Euler reaches from x = 1 at rest: it conserves v² + w² x² + w²
/// x v.
float greatest(float w) { return 1 / std::sqrt(1 - 0.25f * w * w); }

float largest_of(int steps, const std::function<float()>& step) {
  float largest = 0;
  for (int i = 0; i < steps; ++i) largest = std::max(largest, std::abs(step()));
  return largest;
}

}  // namespace

TEST(Steering, SpringsMoveFreeBodiesAsSymplecticEulerDoes) {
  for (const float w : all_omegas)
    for (const float damping : {0.0f, 0.1f}) {
      WorldDef def = quiet_world();
      def.gravity = {};
      World world(def);
      const float k = w * w / (dt * dt);
      const BodyId id = world.add(dynamic(box({0.2f, 0.3f, 0.5f}), {0.1f, -0.2f, 0.3f}, 2));
      Reference x{0.1}, y{-0.2}, z{0.3};
      for (int i = 0; i < 300; ++i) {
        world.apply_force(id, 2 * (-k * world.pose(id).position - (damping / dt) * world.velocity(id).linear));
        world.step();
        for (Reference* r : {&x, &y, &z}) r->step(static_cast<double>(w), static_cast<double>(damping));
      }
      const Vec3 p = world.pose(id).position;
      EXPECT_NEAR(p.x, x.x, 2e-3) << w;
      EXPECT_NEAR(p.y, y.x, 4e-3) << w;
      EXPECT_NEAR(p.z, z.x, 6e-3) << w;
    }
}

// Its joint gives nothing along its way, so each substep moves it along a parabola.
TEST(Steering, ASpringKeepsItsSwingOnASlider) {
  if (quiet_world().partition == Partition::cells) GTEST_SKIP() << "cells have no joints";
  for (const SimulatorKind kind : {SimulatorKind::native, SimulatorKind::device, SimulatorKind::hybrid})
    for (const float w : {0.1f, 0.3f, 1.0f}) {
      WorldDef def = quiet_world();
      def.simulator = kind, def.device = test_device();
      def.gravity = {};
      World world(def);
      BodyDef frame_def = cube({0, 0, 3});
      frame_def.motion = MotionType::fixed;
      const BodyId frame = world.add(frame_def);
      const BodyId body = world.add(dynamic(box({0.25f, 0.25f, 0.25f}), {0.1f, 0, 0}, 1));
      const Pose at = joint_frame({0.1f, 0, 0}, {1, 0, 0});
      world.add_joint(prismatic_joint(frame, body, joint_parts::frame_on(world.pose(frame), at),
                                      joint_parts::frame_on(world.pose(body), at)));
      const float k = w * w / (dt * dt);
      const int period = static_cast<int>(2 * pi / w);
      const auto step = [&] {
        world.apply_force(body, {-k * world.pose(body).position.x, 0, 0});
        world.step();
        return world.pose(body).position.x;
      };
      largest_of(20 * period, step);
      const float largest = largest_of(period + 2, step);
      EXPECT_LT(largest, 0.1f * greatest(w) * 1.01f) << static_cast<int>(kind) << ' ' << w;
      EXPECT_GT(largest, 0.095f) << static_cast<int>(kind) << ' ' << w;
    }
}

TEST(Steering, ASpringHoldsAHangingBody) {
  for (const float w : all_omegas) {
    World world(quiet_world());
    const float k = w * w / (dt * dt), sag = 9.81f / k;
    const BodyId id = world.add(cube({0, 0, -sag + 0.1f}));
    const float largest = largest_of(3000, [&] {
      world.apply_force(id, {0, 0, -k * world.pose(id).position.z});
      world.step();
      return world.pose(id).position.z + sag;
    });
    EXPECT_LT(largest, 0.1f * greatest(w) * 1.01f) << w;
    EXPECT_GT(largest, 0.09f) << w;
  }
}

TEST(Steering, WhatFloatsBetweenWeightAndBuoyancyStaysWhereItIs) {
  for (const float damping : {0.0f, 0.5f}) {
    World world(quiet_world());
    BodyDef def = cube({0, 0, 3});
    def.linear_damping = damping;
    const BodyId id = world.add(def);
    for (int i = 0; i < 600; ++i) {
      world.apply_force(id, {0, 0, 9.81f});
      world.step();
    }
    EXPECT_NEAR(world.pose(id).position.z, 3, 1e-4);
  }
}

TEST(Steering, GravityAloneMakesExactParabolas) {
  World world(quiet_world());
  BodyDef def = cube({0, 0, 100});
  def.velocity.linear = {3, 0, 4};
  const BodyId id = world.add(def);
  for (int i = 0; i < 120; ++i) {
    world.apply_torque(id, {0, 0, 0.1f});
    world.step();
  }
  EXPECT_NEAR(world.pose(id).position.z, 100 + 4 * 2 - 0.5 * 9.81 * 4, 1e-3);
}

TEST(Steering, SpringsAreStableOnAPlaneWithoutFriction) {
  for (const float w : all_omegas)
    for (const Shape& shape : {box({0.5f, 0.5f, 0.5f}), sphere(0.5f), box({0.5f, 1, 0.5f})}) {
      World world(quiet_world());
      world.add(ground(0));
      BodyDef def = dynamic(shape, {0.1f, 0, 1});
      def.material.friction = 0;
      const BodyId id = world.add(def);
      run(world, 60);
      const float k = w * w / (dt * dt);
      const float largest = largest_of(1200, [&] {
        world.apply_force(id, {-k * world.pose(id).position.x, 0, 0});
        world.step();
        return world.pose(id).position.x;
      });
      EXPECT_LT(largest, 0.1f * greatest(w) * 1.02f) << w;
      EXPECT_NEAR(world.pose(id).position.z, 1, 2e-3f) << w;
    }
}

TEST(Steering, SpringsAreStableOnASlopeWithoutFriction) {
  for (const float w : all_omegas) {
    WorldDef def = quiet_world();
    def.gravity = {-4.905f, 0, -8.496f};  // the plane is inclined by 30°
    World world(def);
    world.add(ground(0));
    const BodyId id = world.add(cube({0, 0, 1}));
    world.set_material(id, {.friction = 0});
    const float k = w * w / (dt * dt), sag = -4.905f / k;
    world.set_pose(id, {{sag + 0.1f, 0, 1}, 0, {}});
    const float largest = largest_of(1200, [&] {
      world.apply_force(id, {-k * world.pose(id).position.x, 0, 0});
      world.step();
      return world.pose(id).position.x - sag;
    });
    EXPECT_LT(largest, 0.1f * greatest(w) * 1.05f) << w;
  }
}

/// A body hangs on a spring and is pressed against a wall at the same time.
TEST(Steering, SpringsAreStableWhilePressedAgainstAWall) {
  for (const float w : all_omegas) {
    World world(quiet_world());
    BodyDef wall = ground(0);
    wall.shape = box({0.5f, 50, 50});
    world.add(wall);
    const float k = w * w / (dt * dt), sag = 9.81f / k;
    const BodyId id = world.add(cube({1, 0, 0.1f - sag}));
    world.set_material(id, {.friction = 0});
    float farthest = 1, nearest = 1;
    const float largest = largest_of(1200, [&] {
      const Vec3 p = world.pose(id).position;
      world.apply_force(id, {-30 - k * (p.x - 1), 0, -k * p.z});
      world.step();
      farthest = std::max(farthest, world.pose(id).position.x), nearest = std::min(nearest, world.pose(id).position.x);
      return world.pose(id).position.z + sag;
    });
    EXPECT_LT(largest, 0.1f * greatest(w) * 1.05f) << w;
    EXPECT_LT(farthest, 1.002f) << w;
    EXPECT_GT(nearest, 0.995f) << w;
  }
}

// From ω Δt = 1.7 on it trembles by a millimetre: within the distance that friction yields, such a spring's force
// changes by more than friction can hold.
TEST(Steering, ASpringThatFrictionHoldsMovesNothing) {
  for (const float w : all_omegas) {
    World world(quiet_world());
    world.add(ground());
    const BodyId id = world.add(cube({0, 0, 1}));
    run(world, 60);
    const Vec3 start = world.pose(id).position;
    const float k = w * w / (dt * dt), pull = 0.4f * 9.81f;
    for (int i = 0; i < 600; ++i) {
      world.apply_force(id, {pull - k * (world.pose(id).position.x - start.x), 0, 0});
      world.step();
    }
    EXPECT_NEAR(world.pose(id).position.x, start.x, w < 1.7f ? 1e-3f : 2e-3f) << w;
    EXPECT_LT(kinetic_energy(world, id), w < 1.7f ? 1e-6f : 5e-3f) << w;
  }
}

TEST(Steering, PressedAndBuoyedStacksAreQuiet) {
  for (const float force : {-40.0f, 6.0f}) {
    World world(quiet_world());
    world.add(ground());
    std::vector<BodyId> ids;
    for (int i = 0; i < 6; ++i) ids.push_back(world.add(cube({0, 0, 1.0f + static_cast<float>(i)})));
    Vec3 middle;
    for (int i = 0; i < 600; ++i) {
      for (const BodyId id : ids) world.apply_force(id, {0, 0, force});
      if (i == 300) middle = world.pose(ids[5]).position;
      world.step();
    }
    EXPECT_LT(length(world.pose(ids[5]).position - middle), 1e-3f);
    for (const BodyId id : ids) EXPECT_LT(kinetic_energy(world, id), 1e-6f);
  }
}

namespace {

/// Twice the vector part of the rotation: the angles of a small rotation.
Vec3 small_angles(const World& world, BodyId id) {
  const Quat q = world.pose(id).rotation;
  return (q.w < 0 ? -2.0f : 2.0f) * q.vector();
}

}  // namespace

TEST(Steering, TorqueSpringsAreStableInFlight) {
  for (const float w : all_omegas)
    for (const Shape& shape : {sphere(0.5f), box({0.5f, 0.5f, 0.5f}), box({0.2f, 0.5f, 0.9f}), capsule(0.2f, 0.5f)})
      for (const Vec3 axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
        WorldDef def = quiet_world();
        def.gravity = {};
        World world(def);
        BodyDef one = dynamic(shape, {0, 0, 0}, 3);
        one.pose.rotation = axis_angle(axis, 0.1f);
        const BodyId id = world.add(one);
        const float k = dot(axis, world.mass_properties(id).inertia * axis) * w * w / (dt * dt);
        const float largest = largest_of(1200, [&] {
          world.apply_torque(id, -k * small_angles(world, id));
          world.step();
          return dot(small_angles(world, id), axis);
        });
        EXPECT_LT(largest, 0.1f * greatest(w) * 1.02f) << w;
        EXPECT_GT(largest, 0.09f) << w;
      }
}

TEST(Steering, TorqueSpringsAreStableOnAPlaneWithoutFriction) {
  for (const float w : all_omegas)
    for (const Shape& shape : {sphere(0.5f), box({0.5f, 0.5f, 0.5f}), box({0.2f, 0.9f, 0.5f})}) {
      World world(quiet_world());
      world.add(ground(0));
      BodyDef one = dynamic(shape, {0, 0, 1}, 3);
      one.material.friction = 0;
      one.pose.rotation = axis_angle({0, 0, 1}, 0.1f);
      const BodyId id = world.add(one);
      const float k = world.mass_properties(id).inertia.zz * w * w / (dt * dt);
      const float largest = largest_of(1200, [&] {
        world.apply_torque(id, {0, 0, -k * small_angles(world, id).z});
        world.step();
        return small_angles(world, id).z;
      });
      EXPECT_LT(largest, 0.1f * greatest(w) * 1.05f) << w;
      EXPECT_NEAR(world.pose(id).position.z, 1, 3e-3f) << w;
    }
}

/// Position and attitude together, tumbling at the start, held against gravity.
TEST(Steering, ADampedControllerBringsABodyToItsTarget) {
  for (const float w : {0.1f, 0.33f, 0.8f})
    for (const Shape& shape : {sphere(0.5f), box({0.2f, 0.5f, 0.9f})}) {
      World world(quiet_world());
      BodyDef one = dynamic(shape, {2, -1, 3}, 5);
      one.velocity = {{1, 2, -3}, 0, {2, -1, 1}, 0};
      one.linear_damping = one.angular_damping = 0.2f;
      const BodyId id = world.add(one);
      const Vec3 moments = world.mass_properties(id).principal_moments;
      const float k = w * w / (dt * dt), c = 2 * 0.3f * w / dt;
      for (int i = 0; i < static_cast<int>(120 / w); ++i) {
        const Vec3 v = world.velocity(id).linear, spin = world.velocity(id).angular;
        world.apply_force(id, 5 * (-k * world.pose(id).position - c * v + Vec3{0, 0, 9.81f}));
        world.apply_torque(id, min_component(moments) * (-0.5f * k * small_angles(world, id) - c * spin));
        world.step();
      }
      EXPECT_LT(length(world.pose(id).position), 2e-3f) << w;
      EXPECT_LT(length(small_angles(world, id)), 2e-2f) << w;
    }
}

/// A spring of 400 N/m with little damping, 1 kg.
TEST(Steering, ALightlyDampedSpringComesToRest) {
  World world(quiet_world());
  const BodyId id = world.add(cube({1, 0, 0}));
  for (int i = 0; i < 900; ++i) {
    world.apply_force(id, -400.0f * world.pose(id).position - 2.0f * world.velocity(id).linear + Vec3{0, 0, 9.81f});
    world.step();
  }
  EXPECT_LT(length(world.pose(id).position), 1e-3f);
}

/// A vehicle with a controller carries a load and pushes another.
TEST(Steering, ControlledBodiesCarryAndPushOthers) {
  for (const float w : {0.1f, 0.3f}) {
    World world(quiet_world());
    world.add(ground(0.2f));
    const BodyId vehicle = world.add(dynamic(box({1, 0.5f, 0.25f}), {0, 0, 2}, 10));
    const BodyId load = world.add(dynamic(box({0.25f, 0.25f, 0.25f}), {0, 0, 2.5f}, 2));
    const BodyId crate = world.add(dynamic(box({0.5f, 0.5f, 0.5f}), {2.5f, 0, 1}, 5));
    const float k = 10 * w * w / (dt * dt), c = 10 * 2 * 0.7f * w / dt;
    for (int i = 0; i < 600; ++i) {
      const Vec3 target{std::min(2.0f, 0.005f * static_cast<float>(i)), 0, 1.2f};
      world.apply_force(vehicle, k * (target - world.pose(vehicle).position) - c * world.velocity(vehicle).linear +
                                     Vec3{0, 0, 12 * 9.81f});
      world.apply_torque(vehicle, -500.0f * small_angles(world, vehicle) - 100.0f * world.velocity(vehicle).angular);
      world.step();
    }
    EXPECT_NEAR(world.pose(vehicle).position.x, 2, 0.05f) << w;
    EXPECT_NEAR(world.pose(crate).position.x, 3.5f, 0.05f) << w;
    EXPECT_NEAR(world.pose(load).position.z - world.pose(vehicle).position.z, 0.5f, 5e-3f) << w;
    for (const BodyId id : {vehicle, load, crate}) EXPECT_LT(length(world.velocity(id).linear), 1e-2f) << w;
  }
}

}  // namespace fathom::steering_test
