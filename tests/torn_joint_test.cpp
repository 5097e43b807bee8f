// Joints that something forces apart (dynamics/torn_joint.hpp), and bodies that joints pull into obstacles.
#include "dynamics/torn_joint.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "joint_worlds.hpp"

namespace fathom::test::torn_joint_test {
namespace {

GenericJoint joint_of(const JointDef& def) { return make_generic_joint(def, {false, false}, 1.0f / 240, 1); }

TEST(TornJoints, GapsAreThoseOfHeldAxes) {
  const Pose frame = joint_frame({}, {0, 0, 1});  // its x is along z
  EXPECT_NEAR(held_gap(joint_of(fixed_joint({}, {}, frame, frame)), {3, 4, 12}), 13, 1e-5f);
  EXPECT_NEAR(held_gap(joint_of(revolute_joint({}, {}, frame, frame)), {3, 4, 12}), 13, 1e-5f);
  JointDef slide = prismatic_joint({}, {}, frame, frame);
  EXPECT_NEAR(held_gap(joint_of(slide), {3, 4, 12}), 5, 1e-5f);
  slide.axis(JointAxisName::x).limit(-1, 10);
  EXPECT_NEAR(held_gap(joint_of(slide), {0, 0, 12}), 2, 1e-5f);
  EXPECT_NEAR(held_gap(joint_of(slide), {0, 0, -4}), 3, 1e-5f);
  EXPECT_EQ(held_gap(joint_of(slide), {0, 0, 5}), 0);
  const GenericJoint rope = joint_of(distance_joint({}, {}, {}, {}, 1, 6));
  EXPECT_NEAR(held_gap(rope, {3, 4, 12}), 7, 1e-5f);
  EXPECT_NEAR(held_gap(rope, {0, 0.5f, 0}), 0.5f, 1e-6f);
  EXPECT_EQ(held_gap(rope, {0, 3, 4}), 0);
}

/// Bodies in a row, each with a ball joint to the one before, whose anchors are `gaps` apart.
struct Row {
  struct Ends {
    std::uint32_t a, b;
    Vec3 anchor_a, anchor_b;
  };
  std::vector<float> masses, gaps;
  std::vector<Pose> poses;
  std::vector<MechanismLink> links;

  Row(std::vector<float> of_masses, std::vector<float> of_gaps) : masses(of_masses), gaps(of_gaps) {
    constexpr std::uint32_t none = MechanismLink::none;
    const auto count = static_cast<std::uint32_t>(masses.size());
    poses.resize(count);
    for (std::uint32_t i = 0; i < count; ++i)
      links.push_back(
          {i, i > 0 ? i - 1 : none, i > 0 ? i - 1 : none, none, none, i + 1, i + 1 < count ? 1u : 0u, 1, 0, masses[i]});
  }
  Ends joint(std::uint32_t j) const { return {j, j + 1, {}, {gaps[j], 0, 0}}; }
  static GenericJoint generic_joint(std::uint32_t) { return {}; }
  const Pose& pose(std::uint32_t i) const { return poses[i]; }
  float inverse_mass(std::uint32_t i) const { return 1 / masses[i]; }
  static float radius(std::uint32_t) { return 1; }
  float inertia(std::uint32_t i) const { return inertia_where_torn(*this, links.data(), i); }
};

TEST(TornJoints, LighterBodiesCountAsHeavyAsTheHeaviest) {
  const Row row({2, 10, 1, 50, 50}, {0.5f, 0, 0.5f, 0.5f});
  EXPECT_FLOAT_EQ(row.inertia(0), 5);   // 10 kg across a gap
  EXPECT_FLOAT_EQ(row.inertia(1), 1);   // heavier than the one, closed to the other
  EXPECT_FLOAT_EQ(row.inertia(2), 50);  // its child is heavier
  EXPECT_FLOAT_EQ(row.inertia(3), 1);
  EXPECT_FLOAT_EQ(row.inertia(4), 1);  // equal
  EXPECT_FLOAT_EQ(Row({1, 10}, {0.9f * torn_share}).inertia(0), 1);
  EXPECT_FLOAT_EQ(Row({1, 10}, {1.1f * torn_share}).inertia(0), 10);
}

// A heavy block is wedged between two walls, and its joint to a light ball is inside one of them. The joint alone would
// pull the ball there. No motion satisfies contacts and joint, and their forces grew until the ball whirled and, mostly
// after hundreds of steps, passed the wall.
TEST(TornJoints, PullNobodyIntoAWall) {
  constexpr JointWorlds all[] = {{"native", SimulatorKind::native}, {"device", SimulatorKind::device}};
  const float radius = 0.3f;
  const Vec3 anchor{1, 0.85f, 0};
  const auto joints = [&](BodyId block, BodyId ball) {
    return std::vector{ball_joint(block, ball, anchor, {}), fixed_joint(block, ball, {.position = anchor}, {}),
                       distance_joint(block, ball, anchor, {}, 0, 0.05f)};
  };
  for (const JointWorlds& worlds : all)
    for (const float mass : {100.0f, 1000.0f})
      for (std::size_t kind = 0; kind < 3; ++kind) {
        WorldDef def = worlds.quiet();
        def.gravity = {};
        World world(def);
        for (const float x : {-2.0f, 1.0f}) {
          BodyDef wall;
          wall.motion = MotionType::fixed;
          wall.shape = box({1, 10, 10});
          wall.pose.position.x = x;
          world.add(wall);
        }
        const BodyId block = world.add(dynamic(box({0.5f, 0.5f, 0.5f}), {-0.5f, 0, 0}, mass));
        const BodyId ball = world.add(dynamic(sphere(radius), {-radius, 0.85f, 0}, 10));
        world.add_joint(joints(block, ball)[kind]);
        float deepest = 0, fastest = 0;
        for (int step = 0; step < 1500; ++step) {
          world.step();
          deepest = std::max(deepest, world.pose(ball).position.x + radius);
          if (step > 60) fastest = std::max(fastest, length(world.velocity(ball).angular));
        }
        EXPECT_LT(deepest, 0.25f * radius) << worlds.name << ", " << mass << " kg, joint " << kind;
        if (kind != 1) {
          EXPECT_LT(fastest, 1) << worlds.name << ", " << mass << " kg, joint " << kind;
        }
      }
}

// A hand drags a box on a rope into a wall, and stops there. The box swung at some metres per second.
TEST(TornJoints, HoldABodyStillAtAWall) {
  constexpr JointWorlds all[] = {{"native", SimulatorKind::native}, {"device", SimulatorKind::device}};
  for (const JointWorlds& worlds : all) {
    World world(worlds.quiet());
    world.add(fixed(box({1, 10, 10}), {3, 0, 0}));
    const BodyId hand = add_anchor(world, {0, 0, 1.5f}, MotionType::kinematic);
    const BodyId body = world.add(dynamic(box({0.3f, 0.2f, 0.25f}), {0, 0, 1.5f}, 10));
    world.add_joint(distance_joint(hand, body, {}, {}, 0, 0.5f));
    world.set_velocity(hand, {0.5f, 0.05f, 0}, {});
    run(world, 400);
    world.set_velocity(hand, {}, {});
    run(world, 200);
    EXPECT_LT(length(world.velocity(body).linear), 0.1f) << worlds.name;
    EXPECT_LT(world.pose(body).position.x, 1.85f) << worlds.name;
  }
}

}  // namespace
}  // namespace fathom::test::torn_joint_test
