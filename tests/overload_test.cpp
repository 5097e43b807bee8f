// Heavy bodies on light ones that no direct solution holds: balls and other bodies that may roll
// (dynamics/overload.hpp).
#include "dynamics/overload.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/joint.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "world_fixture.hpp"

namespace fathom::overload_test {
namespace {

using namespace test;

TEST(Overload, LoadsThatOnlyChangeMomentumWantNoInertia) {
  EXPECT_EQ(lasting_load(10, 6, 4), 0);
  EXPECT_EQ(lasting_load(10, 20, 0), 0);
  EXPECT_EQ(lasting_load(10, 0, 0), 10);
}

TEST(Overload, TheLighterBodyGrowsAndGivesWayByAQuarter) {
  for (const float mass : {1e-3f, 1.0f, 1e4f})
    for (const float ratio : {2.0f, 100.0f, 1e4f}) {
      const float light = 1 / mass, heavy = light / 1e4f, sum = light + heavy;
      const float scale = wanted_inertia(ratio, light, sum, 1e4f * mass);
      // The effective mass grows with the load: the contact yields a quarter of what it would under `inertia_load`.
      const float effective = sum / (light / scale + heavy / wanted_inertia(ratio, heavy, sum, 1e4f * mass));
      EXPECT_LT(ratio / effective, 1.0f) << ratio;
      EXPECT_GE(wanted_inertia(ratio, heavy, sum, 1e4f * mass), 1);
      EXPECT_LT(wanted_inertia(ratio, heavy, sum, 1e4f * mass), 1 + 1e-3f * ratio);
    }
  EXPECT_EQ(wanted_inertia(0.5f, 1, 1, 1), 1);
  // No more than is useful.
  EXPECT_EQ(wanted_inertia(1e30f, 1, 1, 50), 800);
  EXPECT_EQ(wanted_inertia(1e30f, 1, 1, 0), unsupported_inertia);
}

TEST(Overload, InertiaFollowsItsLoadAndComesBack) {
  float scale = 1;
  for (int i = 0; i < 100; ++i) {
    const float next = next_inertia_scale(scale, 1000, true);
    EXPECT_LE(next, 1.16f * scale);
    scale = next;
  }
  EXPECT_EQ(scale, 1000);
  // Slowly, so that it does not follow a body that bobs: in half a second by less than half.
  for (int i = 0; i < 30; ++i) scale = next_inertia_scale(scale, 1, true);
  EXPECT_GT(scale, 500);
  for (int i = 0; i < 400; ++i) scale = next_inertia_scale(scale, 1, true);
  EXPECT_EQ(scale, 1);
}

TEST(Overload, ABodyWithoutLoadOrSupportLosesItSoon) {
  for (const float wanted : {0.0f, unsupported_inertia}) {
    float scale = 16;
    for (int i = 0; i < 7; ++i) scale = next_inertia_scale(scale, wanted, true);
    EXPECT_EQ(scale, 1);
  }
}

// Whatever its load, or it would fall and slide as if in weaker gravity.
TEST(Overload, ABodyThatMovesLosesItsInertia) {
  EXPECT_TRUE(is_settled({0.06f, 0, -0.07f}));
  EXPECT_FALSE(is_settled({0.08f, 0, -0.09f}));
  float scale = 16;
  for (int i = 0; i < 4; ++i) scale = next_inertia_scale(scale, 16, false);
  EXPECT_EQ(scale, 1);
}

class Carried : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Simulators, Carried, testing::Bool(), [](const testing::TestParamInfo<bool>& on_device) {
  return on_device.param ? "device" : "native";
});

// Bodies that move with their floor keep their inertia, whatever its velocity. Without it the slab's cubes give way,
// and it moves by 0.2 m.
TEST_P(Carried, AHeavySlabStaysOnLightCubes) {
  WorldDef def = quiet_world();
  if (GetParam()) def.simulator = SimulatorKind::device, def.device = test_device();
  World world(def);
  BodyDef floor;
  floor.motion = MotionType::kinematic;
  floor.shape = box({20, 20, 0.5f});
  floor.material.friction = 0.6f;
  floor.pose.position.z = -0.5f;
  const BodyId floor_id = world.add(floor);
  const auto add = [&](Vec3 half, Vec3 position, float mass) {
    BodyDef body = dynamic(box(half), position, mass);
    body.material.friction = 0.6f;
    return world.add(body);
  };
  std::vector<BodyId> ids;
  for (const float x : {-0.7f, 0.7f})
    for (const float y : {-0.7f, 0.7f}) ids.push_back(add({0.25f, 0.25f, 0.25f}, {x, y, 0.25f}, 1));
  ids.push_back(add({1, 1, 0.1f}, {0, 0, 0.6f}, 1000));
  run(world, 300);
  std::vector<Vec3> start;
  for (const BodyId id : ids) start.push_back(world.pose(id).position);
  float speed = 0;
  for (int i = 0; i < 240; ++i) {
    speed = std::min(speed + 2.0f / 60, 2.0f);
    floor.pose.position.x += speed / 60;
    world.move_to(floor_id, floor.pose);
    world.step();
  }
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const Vec3 shift = world.pose(ids[i]).position - start[i] - Vec3{floor.pose.position.x, 0, 0};
    EXPECT_LT(length(shift), 0.02f) << i;
  }
}

/// A slab on 16 balls of 1/16 kg each, `ratio` times as heavy as all of them; the balls' radius in m, and the step
/// rate.
struct HeavyOnBalls : testing::TestWithParam<std::tuple<float, float, float, bool>> {};

TEST_P(HeavyOnBalls, BallsAreNotPressedIn) {
  const auto [ratio, radius, rate, on_device] = GetParam();
  WorldDef def = quiet_world();
  if (on_device) def.simulator = SimulatorKind::device, def.device = test_device();
  def.dt = 1 / rate;
  World world(def);
  world.add(ground());
  for (int i = 0; i < 16; ++i) {
    const float x = 3 * radius * (static_cast<float>(i % 4) - 1.5f),
                y = 3 * radius * (static_cast<float>(i / 4) - 1.5f);
    world.add(dynamic(sphere(radius), {x, y, 0.5f + radius}, 1.0f / 16));
  }
  const BodyId slab = world.add(dynamic(box({6 * radius, 6 * radius, radius}), {0, 0, 0.5f + 3 * radius}, ratio));
  const float unit = std::sqrt(std::max(1.0f, radius));  // s; larger bodies fall more slowly
  for (int i = 0; i < static_cast<int>(3 * unit * rate); ++i) world.step();
  const float sunk = 0.5f + 3 * radius - world.pose(slab).position.z;
  EXPECT_LT(sunk, 0.1f * radius);
  EXPECT_GT(sunk, -0.1f * radius);
  EXPECT_LT(length(world.velocity(slab).linear), 0.1f * unit);
}

INSTANTIATE_TEST_SUITE_P(Native, HeavyOnBalls,
                         testing::Combine(testing::Values(10.0f, 100.0f), testing::Values(0.02f, 0.5f, 8.0f),
                                          testing::Values(60.0f, 240.0f), testing::Values(false)));
INSTANTIATE_TEST_SUITE_P(Device, HeavyOnBalls,
                         testing::Combine(testing::Values(10.0f, 100.0f), testing::Values(0.02f, 0.5f, 8.0f),
                                          testing::Values(60.0f), testing::Values(true)));

/// Bodies with a small load keep their own inertia: a cart rolls down a slope as its rollers' masses determine.
TEST(Overload, RollersWithAModestLoadKeepTheirInertia) {
  WorldDef def = quiet_world();
  const float tangent = 0.05f, c = 1 / std::sqrt(1 + tangent * tangent);
  def.gravity = {9.81f * tangent * c, 0, -9.81f * c};
  World world(def);
  world.add(ground());
  const float mass = 1, load = 8;
  for (int i = 0; i < 4; ++i) {
    BodyDef roller = dynamic(capsule(0.25f, 0.5f), {static_cast<float>(i) - 1.5f, 0, 0.75f}, mass);
    roller.pose.rotation = axis_angle({1, 0, 0}, 0.5f * pi);
    world.add(roller);
  }
  const BodyId cart = world.add(dynamic(box({3, 0.5f, 0.1f}), {0, 0, 1.1f}, load));
  for (int i = 0; i < 30; ++i) world.step();
  const float v0 = world.velocity(cart).linear.x;
  for (int i = 0; i < 30; ++i) world.step();
  // The cart moves twice as fast as its rollers; Lagrange's equation for the cart's speed. A capsule's moment about its
  // axis is close to that of a cylinder.
  const float inertia = load + 4 * (mass / 4 + 0.5f * mass / 4), force = (load + 4 * mass / 2) * def.gravity.x;
  const float expected = force / inertia * 0.5f;
  EXPECT_NEAR(world.velocity(cart).linear.x - v0, expected, 0.05f * expected);
}

WorldDef on(bool device) {
  WorldDef def = quiet_world();
  if (device) def.simulator = SimulatorKind::device, def.device = test_device();
  return def;
}

/// Tiles and towers of bodies on each other: edge and height of each (m), and their number.
struct Stack {
  float edge, height;
  int count;
};

// Sag is proportional to the size of what yields; otherwise ten tiles of 1 cm lose a third of their height.
TEST(Overload, SmallStacksKeepTheirHeight) {
  for (const bool device : {false, true})
    for (const Stack& stack : {Stack{0.1f, 0.01f, 10}, Stack{0.1f, 0.01f, 20}, Stack{0.05f, 0.05f, 10},
                               Stack{0.03f, 0.03f, 8}, Stack{0.01f, 0.01f, 5}}) {
      World world(on(device));
      world.add(ground());
      BodyId top;
      for (int i = 0; i < stack.count; ++i)
        top = world.add(dynamic(box({0.5f * stack.edge, 0.5f * stack.edge, 0.5f * stack.height}),
                                {0, 0, 0.5f + stack.height * (static_cast<float>(i) + 0.5f)}));
      for (int i = 0; i < 300; ++i) world.step();
      const float height = stack.height * static_cast<float>(stack.count);
      EXPECT_NEAR(world.pose(top).position.z - 0.5f + 0.5f * stack.height, height, 0.01f * height)
          << stack.count << " of " << stack.height << (device ? " m, device" : " m, native");
    }
}

// Each pair has a ratio of at most 10:1, but loads add up.
TEST(Overload, AThinPlateCarriesManyBoxes) {
  for (const bool device : {false, true})
    for (const float mass : {1.0f, 5.0f}) {
      World world(on(device));
      world.add(ground());
      const BodyId plate = world.add(dynamic(box({2.5f, 2.5f, 0.05f}), {0, 0, 0.55f}, mass));
      for (int i = 0; i < 25; ++i)
        world.add(dynamic(box({0.4f, 0.4f, 0.4f}),
                          {0.9f * static_cast<float>(i % 5 - 2), 0.9f * static_cast<float>(i / 5 - 2), 1.0f},
                          10 * mass));
      for (int i = 0; i < 300; ++i) world.step();
      EXPECT_NEAR(world.pose(plate).position.z, 0.55f, 1e-3f) << mass << (device ? " kg, device" : " kg, native");
    }
}

/// A body of this size (m) on the ground at x (m), and a load of `mass` (kg) on it, which is added to `loads`.
BodyId add_loaded(World& world, float size, float mass, std::vector<BodyId>& loads, float x = 0) {
  const BodyId body = world.add(dynamic(box({0.9f * size, 0.5f * size, 0.7f * size}), {x, 0, 0.5f + 0.9f * size}));
  loads.push_back(world.add(dynamic(box({size, size, size}), {x + 0.2f * size, 0, 0.5f + 3 * size}, mass)));
  return body;
}

// Under its load the body gets inertia that owes it momentum. It must not get that when the joint goes, seconds later.
TEST(Overload, ABodyThatWasLoadedFallsFreelyWhenItsJointGoes) {
  if (quiet_world().partition == Partition::cells) GTEST_SKIP() << "has no joints";
  for (const float size : {0.02f, 0.05f, 0.08f})
    for (const float mass : {3.0f, 30.0f, 100.0f})
      for (int steps = 20; steps <= 60; steps += 10) {
        World world(quiet_world());
        world.add(ground());
        std::vector<BodyId> loads;
        const BodyId body = add_loaded(world, size, mass, loads);
        BodyDef def;
        def.motion = MotionType::kinematic, def.shape = sphere(0.01f * size), def.pose.position = {0, 0, 10};
        def.filter.mask = 0;
        const BodyId holder = world.add(def);
        run(world, steps);
        world.remove(loads[0]);
        Pose held = world.pose(body);
        held.position = held.position - def.pose.position;
        const JointId joint = world.add_joint(fixed_joint(holder, body, held, Pose{}));
        world.set_velocity(holder, {0, 0, 5 * size}, {});
        run(world, 60);
        world.set_velocity(holder, {}, {});
        run(world, 20);
        const Velocity before = world.velocity(body);
        world.remove_joint(joint);
        world.step();
        const Vec3 fall = world.velocity(body).linear - before.linear;
        EXPECT_LT(length(fall - Vec3{0, 0, -9.81f / 60}), 1e-4f) << size << " m, " << mass << " kg, " << steps;
        EXPECT_LT(length(world.velocity(body).angular - before.angular), 1e-2f)
            << size << " m, " << mass << " kg, " << steps;
      }
}

// What it is owed under its load ends with the velocity that it had there.
TEST(Overload, ABodyThatWasLoadedFallsFreelyWhereItIsPut) {
  for (const float size : {0.02f, 0.05f, 0.08f})
    for (const float mass : {3.0f, 30.0f, 100.0f})
      for (int steps = 20; steps <= 60; steps += 10) {
        World world(quiet_world());
        world.add(ground());
        std::vector<BodyId> loads;
        const BodyId body = add_loaded(world, size, mass, loads);
        run(world, steps);
        world.set_pose(body, {{0, 0, 10}, 0, {}});
        world.set_velocity(body, {}, {});
        run(world, 10);
        const Velocity v = world.velocity(body);
        EXPECT_LT(length(v.linear - Vec3{0, 0, -9.81f / 6}), 1e-4f) << size << " m, " << mass << " kg, " << steps;
        EXPECT_LT(length(v.angular), 1e-2f) << size << " m, " << mass << " kg, " << steps;
      }
}

// Several threads move free bodies beside the layout of constraints, in which bodies get back what they are owed.
TEST(Overload, FreeBodiesGetBackTheSameWithAnyNumberOfThreads) {
  for (int steps = 20; steps <= 60; steps += 10) {
    const auto fall = [&](int threads) {
      WorldDef def = quiet_world();
      def.threads = threads;
      World world(def);
      std::vector<BodyId> held{world.add(ground())};
      for (int i = 0; i < 1000; ++i)
        world.add(dynamic(box({0.1f, 0.1f, 0.1f}), {static_cast<float>(i % 20), static_cast<float>(2 + i / 20), 100}));
      for (int i = 0; i < 20; ++i)
        add_loaded(world, i % 2 ? 0.05f : 0.02f, i % 3 ? 3 : 30, held, static_cast<float>(-i));
      run(world, steps);
      for (const BodyId id : held) world.remove(id);
      run(world, 5);
      return world.state_hash();
    };
    const std::uint64_t alone = fall(1);
    EXPECT_EQ(fall(2), alone) << steps;
    EXPECT_EQ(fall(4), alone) << steps;
  }
}

}  // namespace
}  // namespace fathom::overload_test
