// Contacts of bodies that joints hold from behind, bodies that are jammed, and loads on small bodies.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/compound.hpp>
#include <fathom/joint.hpp>
#include <string>
#include <vector>

#include "dynamics/contact_rows.hpp"
#include "dynamics/free_way.hpp"
#include "dynamics/overload.hpp"
#include "random.hpp"
#include "simulator_fixture.hpp"

namespace fathom::test::held_from_behind_test {
namespace {

class HeldFromBehind : public OnSimulator {};
INSTANTIATE_TEST_SUITE_P(Simulators, HeldFromBehind, testing::Values(SimulatorKind::native, SimulatorKind::device),
                         simulator_name);

/// A fixed body that touches nothing, to hang joints on.
BodyId add_anchor(World& world) {
  BodyDef def = fixed_body(sphere(0.01f), {});
  def.filter.mask = 0;
  return world.add(def);
}

BodyId add(World& world, const Shape& shape, Vec3 position, float mass, float friction = 0.6f) {
  BodyDef def = dynamic(shape, position, mass);
  def.material.friction = friction;
  return world.add(def);
}

/// Whether the body lies still in the last fifth of so many steps.
void expect_rest(World& world, BodyId body, int steps, const char* what) {
  run(world, 4 * steps / 5);
  const Vec3 position = world.pose(body).position;
  float fastest = 0;
  for (int i = 0; i < steps / 5; ++i) {
    world.step();
    fastest = std::max(fastest, length(world.velocity(body).linear));
  }
  EXPECT_LT(fastest, 0.01f) << what;
  EXPECT_LT(distance(world.pose(body).position, position), 1e-3f) << what;
}

// Springs against the fixed block knew only the lever's own mass, and drove it up at 1.4 rad/s.
TEST_P(HeldFromBehind, ALeverRestsNearItsHinge) {
  World world(world_def());
  const BodyId anchor = add_anchor(world);
  world.add(fixed_body(box({0.05f, 0.2f, 0.2f}), {0.25f, 0, -0.25f}));
  const BodyId lever = add(world, box({1, 0.1f, 0.05f}), {1, 0, 0}, 40);
  world.add_joint(revolute_joint(anchor, lever, joint_frame({}, {0, 1, 0}), joint_frame({-1, 0, 0}, {0, 1, 0})));
  expect_rest(world, lever, 600, "lever");
}

TEST_P(HeldFromBehind, ACarRestsOnLightWheels) {
  World world(world_def());
  world.add(fixed_body(box({50, 50, 0.5f}), {0, 0, -0.5f}, 0.9f));
  const BodyId car = add(world, box({2, 0.9f, 0.3f}), {0, 0, 0.75f}, 1500);
  BodyId wheel;
  for (int i = 0; i < 4; ++i) {
    const Vec3 at{i & 1 ? 1.3f : -1.3f, i & 2 ? 1.1f : -1.1f, 0.33f};
    BodyDef def = dynamic(capsule(0.33f, 0.05f), at, 15);
    def.pose.rotation = axis_angle({1, 0, 0}, 0.5f * pi);
    wheel = world.add(def);
    world.add_joint(
        revolute_joint(car, wheel, joint_frame(at - Vec3{0, 0, 0.75f}, {0, 1, 0}), joint_frame({}, {0, 0, -1})));
  }
  expect_rest(world, wheel, 600, "wheel");
  EXPECT_FALSE(world.is_awake(car));
}

// A box ten times as heavy as the shelf was lost within seconds.
TEST_P(HeldFromBehind, AShelfThatIsWeldedToAWallCarriesTenTimesItsMass) {
  for (const float size : {0.1f, 1.0f})
    for (const float where : {-0.8f, 0.0f, 0.8f}) {
      World world(world_def());
      const BodyId wall = add_anchor(world);
      const BodyId shelf = add(world, box({size, 0.5f * size, 0.05f * size}), {}, 1);
      const Pose end = joint_frame({-size, 0, 0}, {1, 0, 0});
      world.add_joint(fixed_joint(wall, shelf, end, end));
      const BodyId load =
          add(world, box({0.15f * size, 0.15f * size, 0.15f * size}), {where * size, 0, 0.2f * size}, 10);
      expect_rest(world, load, 600, "load");
      EXPECT_NEAR(world.pose(load).position.z, 0.2f * size, 0.02f * size);
    }
}

// The motor held the lift in one sweep of two: the load trembled at 0.1 m/s without end.
TEST_P(HeldFromBehind, ALiftCarriesTenTimesItsMassStandingAndGoing) {
  for (const float speed : {0.0f, 0.2f}) {
    World world(world_def());
    const BodyId shaft = add_anchor(world);
    const BodyId lift = add(world, box({1, 0.5f, 0.05f}), {}, 200);
    JointDef guide = prismatic_joint(shaft, lift, joint_frame({}, {0, 0, 1}), joint_frame({}, {0, 0, 1}));
    guide.axis(JointAxisName::x).drive_velocity(speed, 1e9f);
    world.add_joint(guide);
    const BodyId load = add(world, box({0.15f, 0.15f, 0.15f}), {0, 0, 0.2f}, 2000);
    run(world, 300);
    for (int i = 0; i < 120; ++i) {
      world.step();
      EXPECT_NEAR(world.velocity(load).linear.z, speed, 0.01f);
    }
    EXPECT_NEAR(world.pose(load).position.z - world.pose(lift).position.z, 0.2f, 0.01f);
  }
}

// Round bodies that roll on the ground come to rest; wheels on an axle do not (Rolling, docs/solver.md).
TEST_P(HeldFromBehind, WheelsRollOnSlowly) {
  World world(world_def());
  world.add(fixed_body(box({50, 50, 0.5f}), {0, 0, -0.5f}, 0.8f));
  BodyDef cart = dynamic(box({0.3f, 0.15f, 0.05f}), {0, 0, 0.15f}, 18);
  cart.velocity.linear = {0.06f, 0, 0};
  const BodyId chassis = world.add(cart);
  for (int i = 0; i < 4; ++i) {
    const Vec3 at{i & 1 ? 0.2f : -0.2f, i & 2 ? 0.2f : -0.2f, 0.1f};
    BodyDef wheel = dynamic(sphere(0.1f), at, 4);
    wheel.material.friction = 0.8f;
    wheel.velocity = {{0.06f, 0, 0}, 0, {0, 0.6f, 0}, 0};
    const Vec3 axis{0, 1, 0};
    world.add_joint(
        revolute_joint(chassis, world.add(wheel), joint_frame(at - Vec3{0, 0, 0.15f}, axis), joint_frame({}, axis)));
  }
  run(world, 300);
  EXPECT_NEAR(world.velocity(chassis).linear.x, 0.06f, 0.006f);
}

// Bodies between two others -----------------------------------------------------------------------------------------

class Jammed : public HeldFromBehind {};
INSTANTIATE_TEST_SUITE_P(Simulators, Jammed, testing::Values(SimulatorKind::native, SimulatorKind::device),
                         simulator_name);

// It stood still, and its velocity grew.
TEST_P(Jammed, SlidesBetweenPlatesWithoutFriction) {
  for (const float gap : {0.9f, 0.8f, 0.7f}) {
    World world(world_def());
    for (const float side : {-1.0f, 1.0f}) world.add(fixed_body(box({1, 5, 100}), {side * (1 + 0.25f * gap), 0, 0}, 0));
    BodyDef def = dynamic(box({0.25f, 0.25f, 0.25f}), {});
    def.material.friction = 0;
    const BodyId body = world.add(def);
    run(world, 120);
    EXPECT_NEAR(world.velocity(body).linear.z, -19.62f, 0.2f) << gap;
    EXPECT_NEAR(world.pose(body).position.z, -19.62f, 0.5f) << gap;
  }
}

// A spinning roller carried it round with itself, 0.2 m within a step.
TEST_P(Jammed, DoesNotJumpUnderASpinningRoller) {
  World world(world_def());
  world.add(fixed_body(box({50, 50, 0.5f}), {0, 0, -0.5f}, 0.8f));
  BodyDef roller;
  roller.motion = MotionType::kinematic, roller.shape = capsule(0.5f, 1), roller.material.friction = 0.8f;
  roller.pose = {{0, 0, 0.68f}, 0, axis_angle({1, 0, 0}, 0.5f * pi)};
  roller.velocity.angular = {0, 20, 0};
  world.add(roller);
  const BodyId body = add(world, box({0.3f, 0.3f, 0.1f}), {0.1f, 0, 0.1f}, 1, 0.8f);
  for (int i = 0; i < 120; ++i) {
    const Vec3 before = world.pose(body).position, was = world.velocity(body).linear;
    world.step();
    const float speed = std::max(length(was), length(world.velocity(body).linear));
    ASSERT_LT(distance(world.pose(body).position, before), speed / 60 + 0.02f) << i;
  }
}

TEST_P(Jammed, StaysWhereAPlateWithoutFrictionPressesIt) {
  World world(world_def());
  world.add(fixed_body(box({50, 50, 0.5f}), {0, 0, -0.5f}, 0.8f));
  const BodyId body = add(world, box({0.25f, 0.25f, 0.25f}), {0, 0, 0.25f}, 1, 0.8f);
  BodyDef plate;
  plate.motion = MotionType::kinematic, plate.shape = box({2, 1, 0.1f}), plate.material.friction = 0;
  plate.pose.position = {0, 0, 0.61f};
  const BodyId press = world.add(plate);
  Pose pose = world.pose(press);
  const auto move = [&](Vec3 by) {
    for (int i = 0; i < 60; ++i) pose.position += (1.0f / 60) * by, world.move_to(press, pose), world.step();
  };
  move({0, 0, -0.135f});
  const float at = world.pose(body).position.x;
  move({1, 0, 0});
  EXPECT_NEAR(world.pose(body).position.x, at, 0.1f);
}

// The search for what holds a body back knew the plates only where they were as the step began, and took the depth of
// an overlap from a search that knows none: natively a fifth of the boxes left the cage.
TEST_P(Jammed, NothingLeavesATurningCage) {
  for (const float speed : {5.0f, 20.0f, 400.0f})
    for (std::uint32_t seed = 1; seed <= 30; ++seed) {
      WorldDef def = world_def();
      def.gravity = {};
      World world(def);
      std::vector<ChildShape> plates;
      for (const float side : {-1.0f, 1.0f}) {
        plates.push_back({box({0.01f, 1, 1}), {{side, 0, 0}, 0, {}}});
        plates.push_back({box({1, 0.01f, 1}), {{0, side, 0}, 0, {}}});
        plates.push_back({box({1, 1, 0.01f}), {{0, 0, side}, 0, {}}});
      }
      BodyDef turning;
      turning.motion = MotionType::kinematic, turning.shape = compound(plates);
      turning.velocity.angular = {12, 10, 12};
      const BodyId cage = world.add(turning);
      Generator random(seed);
      BodyDef inside = dynamic(seed % 2 ? sphere(0.05f) : box({0.06f, 0.04f, 0.03f}), 0.7f * in_cube(random));
      inside.velocity.linear = speed * on_sphere(random);
      inside.material.restitution = 0.9f;
      const BodyId body = world.add(inside);
      run(world, 120);
      const Vec3 where = abs(inverse_transform(world.pose(cage), world.pose(body).position));
      EXPECT_LT(max_component(where), 1) << speed << " m/s, seed " << seed;
    }
}

// A lift from one plate to beyond its surface would press the body into the other one.
TEST(FreeWay, OfAJammedBodyIsLiftedNoFartherThanItHasToBe) {
  const Geometry wall = geometry(box({1, 1, 1})), block = geometry(box({0.25f, 0.25f, 0.25f}));
  const Pose at_wall{{-1.2f, 0, 0}, 0, {}}, begin{}, end{{-0.001f, 0.01f, 0}, 0, {}};
  const Mover on_a{wall, 1.8f, at_wall, {}}, on_b{block, 0.44f, begin, velocity_between(begin, end, 0.01f)};
  const Apart first{{1, 0, 0}, -0.05f};
  const FreeWay room = free_way(on_a, on_b, at_wall, end, first, 0.25f, 0.01f);
  ASSERT_TRUE(room.is_lifted);
  EXPECT_GT(room.aside.x, 0.0015f);
  const FreeWay jammed = free_way(on_a, on_b, at_wall, end, first, 0.25f, 0.01f, HoldBack::jammed);
  ASSERT_TRUE(jammed.is_lifted);
  EXPECT_NEAR(jammed.aside.x, 0.001f, 1e-5f);
  const Pose a_little{{-1e-6f, 0.01f, 0}, 0, {}};
  EXPECT_TRUE(free_way(on_a, on_b, at_wall, a_little, first, 0.25f, 0.01f, HoldBack::jammed).is_free);
  EXPECT_FALSE(free_way(on_a, on_b, at_wall, a_little, first, 0.25f, 0.01f).is_free);
}

TEST(Rounds, OfJointedBodiesLeaveOutTheJammedOnes) {
  std::vector<int> free, with_joints;
  for (int round = 0; round < hold_back_rounds; round = round_after(round, false)) free.push_back(round);
  for (int round = 0; round < hold_back_rounds; round = round_after(round, true)) with_joints.push_back(round);
  EXPECT_EQ(free, (std::vector{0, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(with_joints, (std::vector{0, 1, 2, 3, 6, 7}));
  EXPECT_EQ(how_in(2, false), HoldBack::jammed);
  EXPECT_EQ(how_in(2, true), HoldBack::with_room);
}

// Loads on small bodies -----------------------------------------------------------------------------------------------

// Springs grew stiffer while they were compressed, and threw the slab up at 3.7 times its speed.
TEST_P(HeldFromBehind, ASlabThatIsSetDownOnSmallBodiesDoesNotSpringUp) {
  struct Drop {
    float size, ratio;
    int bodies;
  };
  for (const Drop& drop : {Drop{1, 1000, 1}, {1, 1000, 4}, {1, 10000, 4}, {5, 10000, 1}}) {
    World world(world_def());
    const float c = drop.size;
    world.add(fixed_body(box({50 * c, 50 * c, 5 * c}), {0, 0, -5 * c}));
    for (int i = 0; i < drop.bodies; ++i) {
      const float x = drop.bodies == 1 ? 0 : i & 1 ? 0.6f : -0.6f, y = drop.bodies == 1 ? 0 : i & 2 ? 0.6f : -0.6f;
      add(world, sphere(0.3f * c), {x * c, y * c, 0.3f * c}, c * c * c, 0.5f);
    }
    const float height = 0.02f * c, speed = std::sqrt(2 * 9.81f * height);
    const BodyId slab = add(world, box({c, c, 0.25f * c}), {0, 0, 0.85f * c + height}, drop.ratio * c * c * c, 0.5f);
    float rises = 0;
    for (int i = 0; i < 60 + static_cast<int>(120 * std::sqrt(c)); ++i) {
      world.step();
      rises = std::max(rises, world.velocity(slab).linear.z);
    }
    EXPECT_LT(rises, speed) << c << ' ' << drop.ratio << ' ' << drop.bodies;
  }
}

TEST(PushOutShare, FallsWithAddedInertia) {
  EXPECT_EQ(push_out_share(0, 1, 1, 1, 3), 1);
  EXPECT_FLOAT_EQ(push_out_share(0, 1, 0.5f, 2, 3), 0.25f) << "1 kg counts as 2 kg";
  EXPECT_FLOAT_EQ(push_out_share(0, 1, 0.01f, 100, 3), loaded_push_out / 3);
  EXPECT_EQ(push_out_share(0, 1, 0.01f, 100, 0.1f), 1) << "slower than that anyway";
}

TEST(JointedPart, FollowsTheLoad) {
  const float fall = 0.1635f;
  EXPECT_EQ(jointed_part(1.9f * fall, 1, fall), 0);
  EXPECT_NEAR(jointed_part(3 * fall, 1, fall), 2.0f / 3, 1e-6f) << "in thirds";
  EXPECT_EQ(jointed_part(0.4f * fall, 10, fall), 1) << "weight of 0.1 kg";
  EXPECT_EQ(jointed_part(1, 1, 0), 0) << "no weight to compare with";
}

// Whatever moves with the bodies of such a contact, its spring does not gain energy (`soft_step`): x'' = −λ / (h M) in
// substeps, with the mass that the contact knows a share k of M, and velocities relaxed after each.
TEST(SoftStep, OfJointedContactsIsStableForAnyMassBehindIt) {
  const float h = 1.0f / 240;
  WorldDef def;
  for (const float ratio : {1.0f, 10.0f, 30.0f, 100.0f, 1000.0f, 10000.0f})
    for (const bool fixed : {false, true}) {
      const ContactStep step = soft_step(1 / h, contact_softness(def.solver, h), 1e30f, {0, 1, 1, fixed}, 0, 1);
      const double k = 1 / static_cast<double>(ratio);
      double x = -0.001, v = 0, impulse = 0, first = 0, last = 0;  // in units of the known mass
      for (int i = 0; i < 40000; ++i) {
        v += k * impulse;
        double more = -static_cast<double>(step.mass_scale) * (v + static_cast<double>(step.bias_rate) * x) -
                      static_cast<double>(step.impulse_scale) * impulse;
        impulse += more, v += k * more;
        x += static_cast<double>(h) * v;
        more = -v;
        impulse += more, v += k * more;
        (i < 20000 ? first : last) = std::max(i < 20000 ? first : last, std::abs(x));
      }
      EXPECT_LT(last, 0.9 * first + 1e-9) << ratio << (fixed ? ", fixed" : "");
    }
}

}  // namespace
}  // namespace fathom::test::held_from_behind_test
