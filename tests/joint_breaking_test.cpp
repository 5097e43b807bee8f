// Joints that break: when, how it is reported, and that the same inputs give the same bits however events are read.
#include <gmock/gmock.h>

#include <algorithm>
#include <limits>

#include "joint_worlds.hpp"
#include "random.hpp"

namespace fathom::test::joint_breaking_test {
namespace {

class BreakingJoints : public OfJointWorlds {};
INSTANTIATE_TEST_SUITE_P(Simulators, BreakingJoints, testing::ValuesIn(joint_worlds), joint_world_name);

TEST_P(BreakingJoints, BreakUnderMoreThanTheirForce) {
  World world(GetParam().sleepy());
  const BodyId top = add_anchor(world, {0, 0, 5});
  const BodyId weight = world.add(dynamic(sphere(0.2f), {0, 0, 4}, 10));
  JointDef def = ball_joint(top, weight, {}, {0, 0, 1});
  def.break_force = 105, def.user_data = 7;
  const JointId joint = world.add_joint(def);
  run(world, 300);
  ASSERT_TRUE(world.contains(joint)) << "98.1 N hang on it";
  EXPECT_TRUE(world.joints_broken().empty());
  world.apply_force(weight, {0, 0, -20});
  world.step();
  ASSERT_EQ(world.joints_broken().size(), 1);
  const JointBreak b = world.joints_broken()[0];
  EXPECT_EQ(b.joint, joint);
  EXPECT_EQ(b.a, top);
  EXPECT_EQ(b.b, weight);
  EXPECT_EQ(b.step, 301);
  EXPECT_EQ(b.user_data, 7);
  EXPECT_NEAR(b.force.z, 118.1f, 0.5f);
  EXPECT_FALSE(world.contains(joint));
  EXPECT_EQ(world.joint_count(), 0);
  const float before = world.velocity(weight).linear.z;
  run(world, 60);
  EXPECT_TRUE(world.joints_broken().empty());
  EXPECT_NEAR(world.velocity(weight).linear.z, before - 9.81f, 0.05f);
}

TEST_P(BreakingJoints, BreakUnderMoreThanTheirTorque) {
  World world(GetParam().quiet());
  const BodyId wall = add_anchor(world, {0, 0, 5});
  const BodyId beam = world.add(dynamic(box({0.5f, 0.1f, 0.1f}), {0.5f, 0, 5}, 2));
  // The fixed body is B: the torque is that on B.
  const JointId weld = world.add_joint(fixed_joint(beam, wall, {.position = {-0.5f, 0, 0}}, {}));
  world.set_joint_break(weld, unbreakable, 15);
  run(world, 120);
  ASSERT_TRUE(world.contains(weld)) << "9.81 N·m hold it";
  world.set_joint_break(weld, unbreakable, 9);
  world.step();
  ASSERT_EQ(world.joints_broken().size(), 1);
  EXPECT_NEAR(world.joints_broken()[0].torque.y, 9.81f, 0.2f);
}

TEST_P(BreakingJoints, ASleeperWakesWhenItGetsWeaker) {
  World world(GetParam().sleepy());
  const Chain chain(world, add_anchor(world, {0, 0, 5}), {0, 0, 5}, {0, 0, -1}, 3);
  run(world, 200);
  ASSERT_FALSE(world.is_awake(chain.links[2]));
  world.set_joint_break(chain.joints[1], 10, unbreakable);
  world.step();
  ASSERT_EQ(world.joints_broken().size(), 1);
  EXPECT_EQ(world.joints_broken()[0].joint, chain.joints[1]);
  run(world, 30);
  EXPECT_LT(world.pose(chain.links[2]).position.z, 3.5f);
}

// Bodies that a joint kept apart collide once it is gone.
TEST_P(BreakingJoints, BodiesCollideAfterwards) {
  World world(GetParam().quiet());
  world.add(ground());
  const BodyId lower = world.add(cube({0, 0, 1})), upper = world.add(cube({0, 0, 2}));
  const JointId weld =
      world.add_joint(fixed_joint(lower, upper, {.position = {0, 0, 0.5f}}, {.position = {0, 0, -0.5f}}));
  run(world, 30);
  world.set_joint_break(weld, 5, unbreakable);
  run(world, 60);
  EXPECT_EQ(world.joint_count(), 0);
  EXPECT_NEAR(world.pose(upper).position.z, 2, 0.01f);
}

/// A bridge of welded planks with random strengths, onto which boxes fall.
struct Bridge {
  World world;
  Bridge(const WorldDef& settings, unsigned seed) : world(settings) {
    Generator random(seed);
    world.add(ground());
    BodyId before = add_anchor(world, {-5, 0, 4});
    for (int i = 0; i < 12; ++i) {
      const float x = -4.6f + 0.8f * static_cast<float>(i);
      const BodyId plank = world.add(dynamic(box({0.35f, 0.5f, 0.05f}), {x, 0, 4}, 2));
      JointDef def = revolute_joint(before, plank, {.position = {0.4f, 0, 0}}, {.position = {-0.4f, 0, 0}});
      if (i == 0) def.frame_a.position = {0, 0, 0};
      for (Pose* frame : {&def.frame_a, &def.frame_b}) frame->rotation = axis_angle({0, 0, 1}, 1.5707963f);
      def.break_force = 300.0f * static_cast<float>(random() % 8 + 1), def.break_torque = 400;
      world.add_joint(def);
      before = plank;
    }
    for (int i = 0; i < 20; ++i)
      world.add(dynamic(box({0.2f, 0.2f, 0.2f}),
                        {-4 + 0.4f * static_cast<float>(i), 0, 5 + 0.3f * static_cast<float>(random() % 9)}, 20));
  }
};

/// All breaks of a run, and its state hash.
struct Outcome {
  std::vector<JointBreak> breaks;
  std::uint64_t hash = 0;
};
Outcome outcome_of(WorldDef def, unsigned seed, int read_every) {
  Bridge bridge(def, seed);
  Outcome outcome;
  for (int i = 1; i <= 150; ++i) {
    bridge.world.step();
    if (i % read_every) continue;
    const auto broken = bridge.world.joints_broken();
    outcome.breaks.insert(outcome.breaks.end(), broken.begin(), broken.end());
  }
  outcome.hash = bridge.world.state_hash();
  return outcome;
}
bool same(const JointBreak& x, const JointBreak& y) {
  return x.joint == y.joint && x.step == y.step && x.force == y.force && x.torque == y.torque;
}

TEST_P(BreakingJoints, AreAlikeForAnyNumberOfThreads) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    const Outcome first = outcome_of(GetParam().quiet(1), seed, 1);
    EXPECT_GE(first.breaks.size(), 1) << seed;
    for (const int threads : {2, 3, 4}) {
      const Outcome other = outcome_of(GetParam().quiet(threads), seed, 1);
      EXPECT_EQ(first.hash, other.hash) << seed << ", " << threads;
      ASSERT_TRUE(std::ranges::equal(first.breaks, other.breaks, same)) << seed << ", " << threads;
    }
  }
}

// Steps ahead: reading late loses nothing and changes nothing.
TEST(BreakingJointsAhead, AreToldOnceAndDoNotDependOnReading) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    WorldDef def = JointWorlds{"device", SimulatorKind::device}.quiet();
    const Outcome first = outcome_of(def, seed, 1);
    for (const int ahead : {1, 3}) {
      def.ahead = ahead;
      for (const int every : {1, 10}) {
        const Outcome other = outcome_of(def, seed, every);
        EXPECT_EQ(first.hash, other.hash);
        EXPECT_TRUE(std::ranges::equal(first.breaks, other.breaks, same)) << ahead << ", " << every;
      }
    }
  }
}

TEST_P(BreakingJoints, SnapshotsGoOnAlike) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    Bridge bridge(GetParam().quiet(), seed);
    run(bridge.world, 20);
    for (int i = 0; i < 60; ++i) {
      std::vector<std::byte> bytes;
      bridge.world.save(bytes);
      World copy(GetParam().quiet());
      copy.restore(bytes);
      ASSERT_TRUE(std::ranges::equal(bridge.world.joints_broken(), copy.joints_broken(), same));
      bridge.world.step(), copy.step();
      ASSERT_EQ(bridge.world.state_hash(), copy.state_hash());
      ASSERT_TRUE(std::ranges::equal(bridge.world.joints_broken(), copy.joints_broken(), same));
    }
  }
}

TEST_P(BreakingJoints, RefuseWhatIsNoStrength) {
  World world(GetParam().quiet());
  const BodyId a = add_anchor(world, {}), b = world.add(cube({0, 0, 3}));
  JointDef def = ball_joint(a, b, {}, {});
  for (const float bad : {-1.0f, std::numeric_limits<float>::quiet_NaN()}) {
    def.break_force = bad;
    EXPECT_THROW(world.add_joint(def), Error);
    def.break_force = 1, def.break_torque = bad;
    EXPECT_THROW(world.add_joint(def), Error);
    def.break_torque = 1;
  }
  const JointId joint = world.add_joint(def);
  EXPECT_THROW(world.set_joint_break(joint, -1, 1), Error);
  EXPECT_EQ(world.joint(joint).break_force, 1);
  const float inf = std::numeric_limits<float>::infinity();
  world.set_joint_break(joint, inf, inf);
  EXPECT_FALSE(world.joint(joint).can_break());
}

}  // namespace
}  // namespace fathom::test::joint_breaking_test
