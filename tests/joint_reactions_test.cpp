// Restitution at limits, armature and friction of axes, on every simulator, against closed forms.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "joint_worlds.hpp"
#include "random.hpp"

namespace fathom::test::joint_reactions_test {
namespace {

class ReactingAxes : public OfJointWorlds {
 protected:
  WorldDef weightless(float dt = 1.0f / 60, int substeps = 4) const {
    WorldDef def = GetParam().quiet();
    def.gravity = {}, def.dt = dt, def.solver.substeps = substeps;
    return def;
  }
};
INSTANTIATE_TEST_SUITE_P(Simulators, ReactingAxes, testing::ValuesIn(joint_worlds), joint_world_name);

float position(const World& world, JointId id, JointAxisName axis) {
  return world.joint_positions(id)[static_cast<std::size_t>(axis)];
}

/// A body on a slider along x, and one on a hinge about x through its centre.
struct Axes {
  BodyId slider, wheel;
  JointId slide, turn;

  template <class Set>
  Axes(World& world, const Set& set, bool swapped = false, float mass = 2) {
    const BodyId post = add_anchor(world, {0, 0, 5});
    slider = world.add(dynamic(box({0.1f, 0.2f, 0.3f}), {0, 0, 5}, mass));
    wheel = world.add(dynamic(box({0.1f, 0.3f, 0.2f}), {0, 0, 5}, mass));
    JointDef slides = swapped ? prismatic_joint(slider, post, {}, {}) : prismatic_joint(post, slider, {}, {});
    JointDef turns = swapped ? revolute_joint(wheel, post, {}, {}) : revolute_joint(post, wheel, {}, {});
    slides.collide_connected = turns.collide_connected = false;
    set(slides.axis(JointAxisName::x)), set(turns.axis(JointAxisName::twist));
    slide = world.add_joint(slides), turn = world.add_joint(turns);
    world.set_filter(slider, {.category = 1, .mask = 0}), world.set_filter(wheel, {.category = 1, .mask = 0});
  }
};

TEST_P(ReactingAxes, LimitsThrowBack) {
  for (const auto& [dt, substeps] : {std::pair{1.0f / 30, 2}, {1.0f / 60, 4}, {1.0f / 240, 8}})
    for (const float restitution : {0.0f, 0.3f, 1.0f})
      for (const bool swapped : {false, true}) {
        World world(weightless(dt, substeps));
        const Axes axes(
            world, [&](JointAxis& a) { a.limit(-0.3f, 0.3f).restitution = restitution; }, swapped);
        world.set_velocity(axes.slider, {3, 0, 0}, {});
        world.set_velocity(axes.wheel, {}, {-4, 0, 0});
        float farthest = 0;
        for (float t = 0; t < 0.15f; t += dt) {
          world.step();
          farthest = std::max({farthest, std::abs(position(world, axes.slide, JointAxisName::x)),
                               std::abs(position(world, axes.turn, JointAxisName::twist))});
        }
        EXPECT_NEAR(world.velocity(axes.slider).linear.x, -3 * restitution, 1e-3f) << dt;
        EXPECT_NEAR(world.velocity(axes.wheel).angular.x, 4 * restitution, 1e-3f) << dt;
        EXPECT_LT(farthest, 0.3001f);
      }
}

// Below the threshold, and pressed by a motor, an axis stays at its limit.
TEST_P(ReactingAxes, WhatPressesOnALimitStaysThere) {
  const float beyond_limits = GetParam().simulator == SimulatorKind::device ? 3e-3f : 1e-4f;  // sweeps only
  World world(weightless());
  const Axes axes(world, [](JointAxis& a) { a.limit(-0.3f, 0.3f).drive_velocity(3, 50).restitution = 0.5f; });
  run(world, 200);
  for (int i = 0; i < 30; ++i) {
    world.step();
    ASSERT_NEAR(position(world, axes.slide, JointAxisName::x), 0.3f, beyond_limits);
    ASSERT_NEAR(position(world, axes.turn, JointAxisName::twist), 0.3f, beyond_limits);
  }
}

// A motor of constant force accelerates body and armature.
TEST_P(ReactingAxes, ArmatureIsInertia) {
  for (const float armature : {0.0f, 0.01f, 1.0f, 2000.0f})
    for (const bool swapped : {false, true}) {
      World world(weightless());
      const float force = 2 + armature;
      const Axes axes(
          world, [&](JointAxis& a) { a.drive_velocity(1e4f, force).armature = armature; }, swapped);
      const float inertia = world.mass_properties(axes.wheel).inertia.xx;
      run(world, 60);
      const float sign = swapped ? -1.0f : 1.0f;
      EXPECT_NEAR(sign * world.velocity(axes.slider).linear.x, force / (2 + armature), 1e-3f) << armature;
      EXPECT_NEAR(sign * world.velocity(axes.wheel).angular.x / (force / (inertia + armature)), 1, 2e-3f) << armature;
    }
}

// A pendulum with an armature swings like one with that much more inertia, and keeps its energy.
TEST_P(ReactingAxes, ArmatureSlowsAPendulum) {
  for (const float armature : {0.0f, 0.5f}) {
    WorldDef def = GetParam().quiet();
    def.dt = 1.0f / 240;
    World world(def);
    const BodyId post = add_anchor(world, {0, 0, 5});
    const BodyId rod = world.add(dynamic(box({0.05f, 0.05f, 0.5f}), {0, 0, 4.5f}));
    JointDef hinge = revolute_joint(post, rod, {}, {.position = {0, 0, 0.5f}});
    hinge.axis(JointAxisName::twist).armature = armature;
    const JointId joint = world.add_joint(hinge);
    const float inertia = world.mass_properties(rod).inertia.xx + 0.25f + armature;
    world.set_velocity(rod, {0, 0.05f, 0}, {0.1f, 0, 0});
    const float omega = std::sqrt(9.81f * 0.5f / inertia);
    const int steps = static_cast<int>(std::lround(10 * 2 * 3.14159265f / omega / def.dt));
    float highest = 0;
    for (int i = 0; i < steps; ++i) {
      world.step();
      if (i > steps / 2) highest = std::max(highest, std::abs(position(world, joint, JointAxisName::twist)));
    }
    EXPECT_NEAR(highest * omega / 0.1f, 1, 0.01f) << armature;
    EXPECT_LT(std::abs(position(world, joint, JointAxisName::twist)) * omega / 0.1f, 0.06f) << "a whole period";
  }
}

// A servo's spring acts on the armature too: its frequency is that of both inertias.
TEST_P(ReactingAxes, ADrivesSpringCarriesTheArmature) {
  WorldDef def = weightless(1.0f / 240, 8);
  World world(def);
  const float armature = 6, stiffness = 8 * 39.478f;  // 1 Hz
  const Axes axes(world, [&](JointAxis& a) { a.drive_position(0, stiffness, 0).armature = armature; });
  world.set_velocity(axes.slider, {0.5f, 0, 0}, {});
  run(world, 60);
  EXPECT_NEAR(position(world, axes.slide, JointAxisName::x), 0.5f / 6.2832f * 2, 0.17f * 2);
  const float at_quarter = position(world, axes.slide, JointAxisName::x);
  run(world, 60);
  EXPECT_LT(std::abs(position(world, axes.slide, JointAxisName::x)), 0.05f * at_quarter);
}

// A drive with an armature exerts at most its maximum, and a limit stops both.
TEST_P(ReactingAxes, ArmatureStopsAtLimits) {
  const float most = GetParam().simulator == SimulatorKind::device ? 0.3015f : 0.3002f;  // sweeps only
  const float settled = GetParam().simulator == SimulatorKind::device ? 1.5e-3f : 1e-4f;
  for (const auto& [dt, substeps] : {std::pair{1.0f / 30, 2}, {1.0f / 60, 4}, {1.0f / 240, 8}}) {
    World world(weightless(dt, substeps));
    const Axes axes(world, [](JointAxis& a) { a.limit(-0.3f, 0.3f).drive_velocity(5, 40).armature = 3; });
    for (int i = 0; i < 300; ++i) {
      world.step();
      ASSERT_LT(position(world, axes.slide, JointAxisName::x), most);
      ASSERT_LT(position(world, axes.turn, JointAxisName::twist), most);
    }
    EXPECT_NEAR(position(world, axes.slide, JointAxisName::x), 0.3f, settled);
    EXPECT_NEAR(position(world, axes.turn, JointAxisName::twist), 0.3f, settled);
    EXPECT_NEAR(world.velocity(axes.slider).linear.x, 0, 1e-3f);
  }
}

// 5 N of friction: 4 N do not move it, 9 N accelerate it by 2 m/s².
TEST_P(ReactingAxes, FrictionHoldsUntilItSlips) {
  World world(weightless());
  const Axes axes(world, [](JointAxis& a) { a.friction(5); });
  const auto push = [&](float force) {
    for (int i = 0; i < 60; ++i) {
      world.apply_force(axes.slider, {force, 0, 0});
      world.step();
    }
  };
  push(4);
  EXPECT_NEAR(position(world, axes.slide, JointAxisName::x), 0, 1e-4f);
  push(9);
  EXPECT_NEAR(world.velocity(axes.slider).linear.x, 2, 0.01f);
  run(world, 120);
  EXPECT_NEAR(world.velocity(axes.slider).linear.x, 0, 1e-4f);
}

/// A chain of hinges with random armatures and limits that rebound. Mass ratios of up to 1000:1 and armatures of up to
/// 30 times a link's inertia are for direct solutions; `sweeps` hold 4:1 and armatures equal to it.
World random_arm(const WorldDef& def, unsigned seed, bool sweeps) {
  Generator random(seed);
  World world(def);
  BodyId before = add_anchor(world, {0, 0, 8});
  Vec3 at{0, 0, 8};
  for (int i = 0; i < 5; ++i) {
    const float mass =
        sweeps ? static_cast<float>(1 + random() % 4) : std::pow(10.0f, static_cast<float>(random() % 4) - 1);
    const BodyId link = world.add(dynamic(box({0.05f, 0.06f, 0.3f}), at - Vec3{0, 0, 0.3f}, mass));
    world.set_filter(link, {.category = 1, .mask = 0});
    JointDef hinge = revolute_joint(before, link, {.position = {0, 0, i ? -0.3f : 0}}, {.position = {0, 0, 0.3f}});
    JointAxis& axis = hinge.axis(JointAxisName::twist);
    axis.limit(-0.6f, 0.8f).restitution = 0.1f * static_cast<float>(random() % 11);
    axis.armature = random() % 2 ? mass * (sweeps ? 0.003f : 0.1f) * static_cast<float>(random() % 10) : 0;
    if (random() % 3 == 0) axis.friction(static_cast<float>(random() % 20));
    world.add_joint(hinge);
    world.set_velocity(link, {}, {static_cast<float>(random() % 9) - 4, 0, 0});
    before = link, at.z -= 0.6f;
  }
  return world;
}

TEST_P(ReactingAxes, RandomArmsStayTogetherAndAreAlikeFromSnapshots) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    WorldDef def = GetParam().quiet();
    def.dt = seed % 3 == 0 ? 1.0f / 30 : seed % 3 == 1 ? 1.0f / 60 : 1.0f / 240;
    def.solver.substeps = 2 << seed % 3;
    World world = random_arm(def, seed, GetParam().simulator == SimulatorKind::device);
    run(world, 60);
    std::vector<std::byte> bytes;
    world.save(bytes);
    World copy(def);
    copy.restore(bytes);
    for (int i = 0; i < 120; ++i) {
      world.step(), copy.step();
      ASSERT_EQ(world.state_hash(), copy.state_hash()) << seed;
      for (const BodyId id : world.bodies()) ASSERT_LT(length(world.velocity(id).linear), 40) << seed;
    }
    EXPECT_LT(widest_gap(world), 0.3f) << seed;
  }
}

TEST_P(ReactingAxes, RefuseWhatCannotBe) {
  World world(weightless());
  const BodyId a = add_anchor(world, {}), b = world.add(cube({0, 0, 3}));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const float bad : {-0.1f, 1.1f, nan}) {
    JointDef def = revolute_joint(a, b, {}, {});
    def.axis(JointAxisName::twist).limit(-1, 1).restitution = bad;
    EXPECT_THROW(world.add_joint(def), Error);
  }
  for (const float bad : {-0.1f, nan}) {
    JointDef def = revolute_joint(a, b, {}, {});
    def.axis(JointAxisName::twist).armature = bad;
    EXPECT_THROW(world.add_joint(def), Error);
  }
  EXPECT_EQ(world.joint_count(), 0);
}

}  // namespace
}  // namespace fathom::test::joint_reactions_test
