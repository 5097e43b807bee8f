// Contacts of mechanisms with bodies that nothing holds: grippers, lids, tables, jacks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/joint.hpp>
#include <vector>

#include "simulator_fixture.hpp"

namespace fathom::test::grips_test {
namespace {

class Grips : public OnSimulator {
 protected:
  static WorldDef quiet() { return on_simulator(quiet_world()); }
};
INSTANTIATE_TEST_SUITE_P(Simulators, Grips,
                         testing::Values(SimulatorKind::native, SimulatorKind::device, SimulatorKind::hybrid),
                         simulator_name);

constexpr float gravity = 9.81f, floor_height = 0.5f;  // of `ground`

JointDef joint_at(World& world, BodyId a, BodyId b, Vec3 at, Vec3 axis,
                  JointDef (*make)(BodyId, BodyId, const Pose&, const Pose&)) {
  const Pose frame = joint_frame(at, axis);
  return make(a, b, joint_parts::frame_on(world.pose(a), frame), joint_parts::frame_on(world.pose(b), frame));
}
JointId weld(World& world, BodyId a, BodyId b, Vec3 at) {
  return world.add_joint(joint_at(world, a, b, at, {0, 0, 1}, fixed_joint));
}
JointId slider(World& world, BodyId a, BodyId b, Vec3 at, Vec3 axis, float speed, float max_force) {
  JointDef def = joint_at(world, a, b, at, axis, prismatic_joint);
  if (max_force > 0) def.axis(JointAxisName::x).drive_velocity(speed, max_force);
  return world.add_joint(def);
}

float fastest_within(World& world, int steps) {
  float fastest = 0;
  for (int i = 0; i < steps; ++i) {
    world.step();
    for (const BodyId id : world.bodies()) fastest = std::max(fastest, length(world.velocity(id).linear));
  }
  return fastest;
}

/// A body of `size` (m) on the ground, between fingers on sliders of a hand that moves as told.
struct Gripper {
  BodyId hand, held;
  std::vector<BodyId> fingers;
  float size, weight;

  /// `share`: of a finger's mass in the body's; `grip`: the motors' force over that which friction needs to hold the
  /// body; `count`: fingers around the body.
  Gripper(World& world, const Shape& shape, float of_size, float share, float grip, int count = 2) : size(of_size) {
    const float half = 0.5f * size, thick = 0.15f * size, friction = 0.5f;
    held = world.add(dynamic(shape, {0, 0, floor_height + half}));
    weight = world.mass(held) * gravity;
    BodyDef def = fixed_body(box({half, 0.2f * size, 0.1f * size}), {0, 0, floor_height + 2 * size});
    def.motion = MotionType::kinematic, def.filter.mask = 0;
    hand = world.add(def);
    for (int i = 0; i < count; ++i) {
      const Quat turn = axis_angle({0, 0, 1}, 2 * pi * static_cast<float>(i) / static_cast<float>(count));
      const Vec3 outwards = rotate(turn, {1, 0, 0});
      BodyDef finger = dynamic(box({thick, 0.4f * size, 0.45f * size}),
                               (half + thick + 0.02f * size) * outwards + Vec3{0, 0, floor_height + 0.53f * size},
                               share * world.mass(held));
      finger.pose.rotation = turn, finger.material.friction = friction;
      fingers.push_back(world.add(finger));
      slider(world, hand, fingers.back(), finger.pose.position, -outwards, 0.5f * std::sqrt(size * gravity),
             grip * weight / (static_cast<float>(count) * friction));
    }
  }
  /// How far (m) the body is below where the hand holds it.
  float below(World& world) const { return world.pose(hand).position.z - world.pose(held).position.z; }
  /// Lifts it at a speed that the hand has at once. Returns by how much (m) it slipped.
  float lift(World& world) const {
    run(world, 30);
    const float before = below(world);
    world.set_velocity(hand, {0, 0, speed()}, {});
    run(world, 60);
    world.set_velocity(hand, {}, {});
    run(world, 120);
    return below(world) - before;
  }
  float speed() const { return 0.3f * std::sqrt(size * gravity); }
  /// What friction of `grip` times the weight lets it slip until it has that speed.
  float expected_slip(float grip) const { return speed() * speed() / (2 * (grip - 1) * gravity); }
};

Shape cube(float size) { return box({0.5f * size, 0.5f * size, 0.5f * size}); }

// Left to sweeps, things of 3 cm slipped by ten times as much or fell.
TEST_P(Grips, ABodySlipsAsFarAsFrictionLetsIt) {
  for (const float size : {0.03f, 0.1f, 0.5f})
    for (const float share : {0.1f, 1.0f, 10.0f})
      for (const float grip : {1.2f, 3.0f}) {
        World world(quiet());
        world.add(ground());
        const Gripper gripper(world, cube(size), size, share, grip);
        const float slip = gripper.lift(world);
        EXPECT_NEAR(slip, gripper.expected_slip(grip), 0.05f * size + 0.45f * gripper.expected_slip(grip))
            << size << ' ' << share << ' ' << grip;
        EXPECT_LT(length(world.velocity(gripper.held).linear), 0.005f * std::sqrt(size * gravity)) << size << share;
      }
}

// A finger of a tenth of the body's mass sank into it by 0.3 of its size before the contact bore the motor's force, and
// then the body was thrown out.
TEST_P(Grips, AStrongGripHoldsStill) {
  for (const float size : {0.2f, 0.5f})
    for (const Shape& shape : {cube(size), sphere(0.5f * size)}) {
      World world(quiet());
      world.add(ground());
      const Gripper gripper(world, shape, size, size > 0.3f ? 0.1f : 0.5f, 50);
      EXPECT_LT(std::abs(gripper.lift(world)), 0.03f * size);
      EXPECT_LT(fastest_within(world, 60), 0.1f) << size;
    }
}

// The fingers are mechanisms of their own, of one shape, which push the same body.
TEST_P(Grips, ThreeFingersHoldABall) {
  for (const float size : {0.1f, 0.5f}) {
    World world(quiet());
    world.add(ground());
    const Gripper gripper(world, sphere(0.5f * size), size, 0.5f, 5, 3);
    EXPECT_LT(gripper.lift(world), 0.06f * size);
    EXPECT_LT(fastest_within(world, 60), 1e-3f) << size;
  }
}

// A clutter of grippers, some of which share bodies, gives the same state whatever the number of threads is.
TEST(GripsNative, ThreadsDoNotMatter) {
  const auto hash = [](int threads) {
    WorldDef def = quiet_world();
    def.simulator = SimulatorKind::native, def.threads = threads;
    World world(def);
    world.add(ground());
    for (int i = 0; i < 12; ++i) {
      const Vec3 at{1.1f * static_cast<float>(i % 4), 1.5f * static_cast<float>(i / 4), 0};
      BodyDef hand_def = fixed_body(box({0.1f, 0.1f, 0.1f}), at + Vec3{0, 0, 2});
      hand_def.motion = MotionType::kinematic, hand_def.filter.mask = 0;
      const BodyId hand = world.add(hand_def);
      world.add(dynamic(cube(0.5f), at + Vec3{0, 0, floor_height + 0.25f}));
      world.add(dynamic(cube(0.3f), at + Vec3{0.55f, 0, floor_height + 0.15f}));
      for (int k = 0; k < 3; ++k) {
        const Quat turn = axis_angle({0, 0, 1}, 2 * pi * static_cast<float>(k) / 3);
        const Vec3 outwards = rotate(turn, {1, 0, 0});
        BodyDef finger = dynamic(box({0.05f, 0.1f, 0.2f}), at + 0.36f * outwards + Vec3{0, 0, floor_height + 0.3f}, 20);
        finger.pose.rotation = turn;
        const BodyId id = world.add(finger);
        slider(world, hand, id, finger.pose.position, -outwards, 1, 3000);
      }
    }
    run(world, 120);
    return world.state_hash();
  };
  const std::uint64_t one = hash(1);
  EXPECT_EQ(hash(2), one);
  EXPECT_EQ(hash(5), one);
}

// With a contact that gives back part of its impulse in every substep a motor pressed with a quarter of its force.
TEST_P(Grips, AMotorPressesWithItsForce) {
  for (const float mass : {1.0f, 100.0f})
    for (const float speed : {0.05f, 1.0f}) {
      World world(quiet());
      const BodyId wall = world.add(fixed_body(cube(1), {0, 0, 1}));
      BodyDef def = dynamic(cube(0.2f), {0.61f, 0, 1}, mass);
      const BodyId piston = world.add(def);
      const float force = 50 * mass * gravity;
      JointDef joint = joint_at(world, wall, piston, def.pose.position, {-1, 0, 0}, prismatic_joint);
      joint.axis(JointAxisName::x).drive_velocity(speed, force);
      joint.collide_connected = true;
      const JointId slide = world.add_joint(joint);
      run(world, 120);
      EXPECT_NEAR(std::abs(world.reaction(slide).force.x), force, 0.01f * force) << mass << ' ' << speed;
      EXPECT_NEAR(world.pose(piston).position.x, 0.6f, 2e-3f);
      EXPECT_LT(fastest_within(world, 30), 1e-3f);
    }
}

// The table and its load are 60:1, and the feet are light: it walked away by metres, by the order of its legs.
TEST_P(Grips, ALoadedTableStandsStill) {
  for (const float size : {0.2f, 0.5f})
    for (const float load : {20.0f, 60.0f}) {
      World world(quiet());
      world.add(ground());
      const Vec3 floor{0, 0, floor_height};
      const BodyId top = world.add(dynamic(box({size, 0.6f * size, 0.05f * size}), floor + Vec3{0, 0, 0.85f * size}));
      for (const float x : {-0.9f, 0.9f})
        for (const float y : {-0.5f, 0.5f}) {
          const Vec3 at = floor + size * Vec3{x, y, 0.4f};
          const BodyId leg = world.add(dynamic(box({0.05f * size, 0.05f * size, 0.4f * size}), at));
          weld(world, top, leg, at + Vec3{0, 0, 0.4f * size});
        }
      world.add(dynamic(cube(0.8f * size), floor + Vec3{0.1f * size, 0, 1.3f * size}, load * world.mass(top)));
      run(world, 600);
      EXPECT_LT(length(world.pose(top).position - floor - Vec3{0, 0, 0.85f * size}), 0.1f * size) << load;
      EXPECT_LT(fastest_within(world, 120), 2e-3f) << size << ' ' << load;
    }
}

TEST_P(Grips, APersonStandsOnALightBox) {
  World world(quiet());
  const BodyId floor = world.add(ground());
  world.add(dynamic(cube(0.4f), {0, 0, floor_height + 0.2f}, 2));
  BodyDef def = dynamic(capsule(0.3f, 0.6f), {0, 0, floor_height + 0.4f + 0.9f}, 80);
  const BodyId person = world.add(def);
  JointDef upright = joint_at(world, floor, person, def.pose.position, {1, 0, 0}, generic_joint);
  for (const auto axis : {JointAxisName::twist, JointAxisName::swing_y, JointAxisName::swing_z})
    upright.axis(axis).mode = AxisMode::locked;
  upright.collide_connected = true;
  world.add_joint(upright);
  run(world, 600);
  EXPECT_LT(fastest_within(world, 120), 1e-3f);
  EXPECT_NEAR(world.pose(person).position.z, def.pose.position.z, 0.02f);
}

// A lid of 20 times the mass of what it closes on, with a motor of 10 times its weight, threw it through the floor.
TEST_P(Grips, ALidThrowsNothing) {
  for (const bool is_cube : {true, false}) {
    const float size = 0.1f;
    World world(quiet());
    const Vec3 floor{0, 0, floor_height};
    const BodyId bottom = world.add(ground());
    BodyDef def = dynamic(is_cube ? cube(0.3f * size) : sphere(0.15f * size), floor + size * Vec3{0.3f, 0.05f, 0.15f});
    const BodyId thing = world.add(def);
    const float angle = 1.2f, mass = 20 * world.mass(thing);
    BodyDef lid_def = dynamic(box({size, size, 0.05f * size}), {}, mass);
    lid_def.pose.rotation = axis_angle({0, 1, 0}, -angle);
    lid_def.pose.position = floor + size * Vec3{std::cos(angle) - 1, 0, 0.05f + std::sin(angle)};
    const BodyId lid = world.add(lid_def);
    JointDef joint = joint_at(world, bottom, lid, floor + size * Vec3{-1, 0, 0.05f}, {0, 1, 0}, revolute_joint);
    joint.axis(JointAxisName::twist).drive_velocity(0.5f * std::sqrt(gravity / size), 10 * mass * gravity * size);
    joint.collide_connected = true;
    world.add_joint(joint);
    float fastest = 0;
    for (int i = 0; i < 300; ++i) {
      world.step();
      fastest = std::max(fastest, length(world.velocity(thing).linear));
    }
    EXPECT_LT(fastest, 1.5f) << is_cube;
    EXPECT_GT(world.pose(thing).position.z, floor_height) << is_cube;
  }
}

// A wedge under a jointed load stays, although it is pushed with a third of what friction holds.
TEST_P(Grips, AWedgeUnderAJointedLoadStays) {
  World world(quiet());
  const BodyId floor = world.add(ground());
  const float ratio = 20, slope = 0.15f;
  const Vec3 corners[] = {{-1, -0.15f, 0}, {1, -0.15f, 0}, {1, -0.15f, 2 * slope},
                          {-1, 0.15f, 0},  {1, 0.15f, 0},  {1, 0.15f, 2 * slope}};
  const Shape wedge = hull(corners);
  const Vec3 centre{1.0f / 3, 0, slope * 2 / 3};
  BodyDef def = dynamic(wedge, Vec3{0, 0, floor_height} + centre);
  def.material.friction = 0.3f;
  const BodyId jack = world.add(def);
  const float weight = world.mass(jack) * gravity;
  const float radius = 0.15f;
  const Vec3 at{0, 0, floor_height + slope + radius / std::cos(std::atan(slope))};
  BodyDef load = dynamic(sphere(radius), at, ratio * world.mass(jack));
  load.material.friction = 0.3f;
  const BodyId follower = world.add(load);
  slider(world, floor, follower, at, {0, 0, 1}, 0, 0);
  const Vec3 before = world.pose(jack).position;
  for (int i = 0; i < 600; ++i) {
    world.apply_force(jack, {-0.1f * ratio * weight, 0, 0});
    world.step();
  }
  EXPECT_LT(length(world.pose(jack).position - before), 0.02f);
}

}  // namespace
}  // namespace fathom::test::grips_test
