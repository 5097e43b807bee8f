// Joints that pull a point of a body towards a target, as a mouse does: they follow it, exert no more than their
// maximum force, are stable for any gain, wake their body and leave no trace when removed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "joint_worlds.hpp"
#include "scene/scene_file.hpp"

namespace fathom::test::target_joint_test {
namespace {

class TargetJoints : public OfJointWorlds {};
INSTANTIATE_TEST_SUITE_P(Worlds, TargetJoints, testing::ValuesIn(joint_worlds), joint_world_name);

constexpr float dt = 1.0f / 60;

BodyId add_box(World& world, Vec3 position, float mass = 2) {
  BodyDef def;
  def.shape = box({0.3f, 0.2f, 0.1f});
  def.mass = mass;
  def.pose.position = position;
  return world.add(def);
}

/// A box held at a point, by default a corner, and the joint that holds it.
struct Held {
  static constexpr Vec3 corner{0.3f, 0.2f, 0.1f};
  World world;
  BodyId holder, body;
  JointId joint;
  Vec3 at;

  Held(const WorldDef& def, float hertz, float damping_ratio, float max_force, float mass = 2, Vec3 on_body = corner)
      : world(def), holder(add_anchor(world, {1, 2, 3})), body(add_box(world, {}, mass)), at(on_body) {
    joint = world.add_joint(target_joint(holder, world.pose(holder), body, at, at, hertz, damping_ratio, max_force));
  }
  Vec3 point() const { return transform(world.pose(body), at); }
};

TEST_P(TargetJoints, FollowTheTarget) {
  Held held(GetParam().quiet(), 6, 1, 1000, 2, {});
  float farthest = 0;
  for (int i = 0; i < 360; ++i) {
    const float t = static_cast<float>(i) * dt;
    const Vec3 target{0.5f - 0.5f * std::cos(t), 0.5f * std::sin(t), 0.2f * t};
    held.world.set_joint_target(held.joint, target);
    held.world.step();
    if (i > 60) farthest = std::max(farthest, distance(held.point(), target));
  }
  // A spring sags by g / ω², and a critically damped one lags by 2 v / ω.
  EXPECT_LT(farthest, 0.04f);
  for (int i = 0; i < 300; ++i) held.world.step();
  EXPECT_LT(length(held.world.velocity(held.body).linear), 0.05f);
}

// However far the target is, in any direction.
TEST_P(TargetJoints, GiveNoMoreThanTheirForce) {
  for (const Vec3 target : {Vec3{1000, 0, 0}, Vec3{-300, 400, 200}, Vec3{1e4f, 1e4f, 1e4f}, Vec3{1, 1, 1}}) {
    WorldDef def = GetParam().quiet();
    def.gravity = {};
    Held held(def, 30, 1, 50, 2, {});
    held.world.set_joint_target(held.joint, target);
    float most = 0;
    for (int i = 0; i < 60; ++i) {
      held.world.step();
      most = std::max(most, length(held.world.reaction(held.joint).force));
    }
    EXPECT_LE(most, 50 * 1.0001f);
    if (length(target) > 100) {
      EXPECT_GT(most, 50 * 0.999f);
      EXPECT_NEAR(length(held.world.velocity(held.body).linear), 50.0f / 2 * 1, 0.3f);  // F t / m
    }
  }
}

// A load beyond the force falls as if the joint carried only that much of its weight.
TEST_P(TargetJoints, LetFallWhatIsTooHeavy) {
  Held held(GetParam().quiet(), 10, 1, 10, 2, {});
  for (int i = 0; i < 60; ++i) held.world.step();
  const float lost = 9.81f - 10.0f / 2;
  EXPECT_NEAR(held.world.velocity(held.body).linear.z, -lost, 0.03f * lost);
}

TEST_P(TargetJoints, AreStableForAnyGain) {
  for (const float hertz : {1e-3f, 1.0f, 60.0f, 1e4f, 1e9f})
    for (const float ratio : {0.0f, 0.5f, 1.0f, 100.0f, 1e9f})
      for (const float mass : {1e-3f, 2.0f, 1e4f}) {
        WorldDef def = GetParam().quiet();
        def.gravity = {};
        Held held(def, hertz, ratio, 3e38f, mass);
        held.world.set_joint_target(held.joint, Held::corner + Vec3{0.2f, 0.3f, 0.1f});
        const auto energy = [&] {
          const Velocity& v = held.world.velocity(held.body);
          const Vec3 spin = inverse_rotate(held.world.pose(held.body).rotation, v.angular);
          return 0.5f *
                 (mass * length_squared(v.linear) + dot(spin, held.world.mass_properties(held.body).inertia * spin));
        };
        float early = 0, late = 0, farthest = 0;
        for (int i = 0; i < 240; ++i) {
          held.world.step();
          (i < 120 ? early : late) = std::max(i < 120 ? early : late, energy());
          farthest = std::max(farthest, distance(held.point(), Held::corner));
        }
        EXPECT_LE(late, 1.02f * early + 1e-6f * mass) << hertz << " Hz, ratio " << ratio << ", " << mass << " kg";
        EXPECT_LE(farthest, 1.0f) << hertz << " Hz, ratio " << ratio << ", " << mass << " kg";
      }
}

TEST_P(TargetJoints, WakeTheirBody) {
  WorldDef def = GetParam().sleepy();
  World world(def);
  BodyDef ground;
  ground.motion = MotionType::fixed;
  ground.shape = box({10, 10, 0.5f});
  ground.pose.position = {0, 0, -0.5f};
  const BodyId floor = world.add(ground);
  const BodyId body = add_box(world, {0, 0, 0.1f});
  const Vec3 target{0, 0, 0.1f};
  const JointId joint = world.add_joint(target_joint(floor, world.pose(floor), body, {}, target, 4, 1, 200));
  for (int i = 0; i < 120; ++i) world.step();
  ASSERT_FALSE(world.is_awake(body));
  world.set_joint_target(joint, target);
  EXPECT_FALSE(world.is_awake(body)) << "the target is there already";
  world.set_joint_target(joint, {0, 0, 2});
  EXPECT_TRUE(world.is_awake(body));
  for (int i = 0; i < 120; ++i) world.step();
  EXPECT_NEAR(world.pose(body).position.z, 2, 0.1f);
  EXPECT_EQ(world.pose(floor).position, ground.pose.position);
  // It is set down on the body that holds the target, and contacts carry it.
  world.set_joint_target(joint, {0, 0, -1});
  for (int i = 0; i < 120; ++i) world.step();
  EXPECT_NEAR(world.pose(body).position.z, 0.1f, 0.02f);
}

TEST_P(TargetJoints, GoWithoutATrace) {
  Held held(GetParam().quiet(), 6, 1, 1000);
  for (int i = 0; i < 30; ++i) held.world.step();
  held.world.remove_joint(held.joint);
  EXPECT_EQ(held.world.joint_count(), 0u);
  const float before = held.world.velocity(held.body).linear.z;
  for (int i = 0; i < 60; ++i) held.world.step();
  EXPECT_NEAR(held.world.velocity(held.body).linear.z, before - 9.81f, 1e-3f);
  // With its holder, too.
  const JointId again =
      held.world.add_joint(target_joint(held.holder, held.world.pose(held.holder), held.body, {}, {}, 6, 1, 1000));
  held.world.step();
  held.world.remove(held.holder);
  EXPECT_FALSE(held.world.contains(again));
  held.world.step();
}

TEST_P(TargetJoints, GoOnFromASnapshotBitForBit) {
  const auto drag = [](World& world, JointId joint, int from) {
    for (int i = from; i < from + 60; ++i) {
      world.set_joint_target(joint, {0.02f * static_cast<float>(i), 0.5f, 1});
      world.step();
    }
    return world.state_hash();
  };
  Held held(GetParam().quiet(), 5, 0.7f, 60);
  drag(held.world, held.joint, 0);
  std::vector<std::byte> bytes;
  held.world.save(bytes);
  World other(GetParam().quiet(2));
  other.restore(bytes);
  EXPECT_EQ(other.joint(held.joint).max_force, 60);
  EXPECT_EQ(drag(held.world, held.joint, 60), drag(other, held.joint, 60));
}

// A body on which others rest is pulled out of a pile, with everything that joints attach to it.
TEST_P(TargetJoints, PullAChainOutOfItsPlace) {
  World world(GetParam().quiet());
  const BodyId holder = add_anchor(world, {0, 0, 10});
  const Chain chain(world, {}, {0, 0, 1}, {1, 0, 0}, 8);
  const JointId joint = world.add_joint(
      target_joint(holder, world.pose(holder), chain.links[0], {}, world.pose(chain.links[0]).position, 4, 1, 400));
  for (int i = 0; i < 600; ++i) {
    world.set_joint_target(joint, {0, 0, std::min(8.0f, 1 + 0.05f * static_cast<float>(i))});
    world.step();
  }
  EXPECT_NEAR(world.pose(chain.links[0]).position.z, 8, 0.5f);
  for (const BodyId link : chain.links) EXPECT_LT(length(world.velocity(link).linear), 5.0f);
}

TEST(TargetJoint, RefusesWhatCannotBe) {
  World world;
  const BodyId holder = add_anchor(world, {}), body = add_box(world, {0, 0, 1}), other = add_box(world, {0, 0, 3});
  const JointDef sound = target_joint(holder, world.pose(holder), body, {}, {}, 4, 1, 100);
  JointDef def = sound;
  def.hertz = 0;
  EXPECT_THROW(world.add_joint(def), Error) << "a rigid joint has no largest force";
  def = sound;
  def.max_force = -1;
  EXPECT_THROW(world.add_joint(def), Error);
  def.max_force = std::nanf("");
  EXPECT_THROW(world.add_joint(def), Error);
  def = fixed_joint(holder, body, {}, {});
  def.hertz = 4, def.max_force = 10;
  EXPECT_THROW(world.add_joint(def), Error) << "axes have drives for that";
  const JointId joint = world.add_joint(sound);
  EXPECT_THROW(world.set_joint_spring(joint, 0, 1), Error);
  EXPECT_THROW(world.set_joint_target(joint, {0, std::nanf(""), 0}), Error);
  const JointId between = world.add_joint(ball_joint(body, other, {}, {}));
  EXPECT_THROW(world.set_joint_target(between, {}), Error);
  world.remove_joint(joint);
  EXPECT_THROW(world.set_joint_target(joint, {}), Error);
}

TEST(TargetJoint, IsInSceneFiles) {
  const std::string bodies = R"([[body]]
name = "wall"
motion = "static"
shape = {type = "box", half_extents = [1, 1, 1]}
position = [0, 0, -5]
[[body]]
name = "crate"
shape = {type = "box", half_extents = [0.5, 0.5, 0.5]}
position = [1, 0, 0]
[[joint]]
type = "target"
)";
  const Scene scene = parse_scene(
      bodies + "a = \"wall\"\nb = \"crate\"\npoint = [1.5, 0, 0]\ntarget = [1, 2, 3]\nhertz = 5\nmax_force = 70\n",
      "scene.toml");
  ASSERT_EQ(scene.joints.size(), 1u);
  const JointDef& def = scene.joints[0].def;
  EXPECT_EQ(def.type, JointType::ball);
  EXPECT_EQ(def.frame_a.position, (Vec3{1, 2, 8}));
  EXPECT_EQ(def.frame_b.position, (Vec3{0.5f, 0, 0}));
  EXPECT_EQ(def.hertz, 5);
  EXPECT_EQ(def.max_force, 70);
  EXPECT_TRUE(def.collide_connected);
  const auto is_refused = [&](const std::string& joint) {
    EXPECT_THROW(parse_scene(bodies + joint, "scene.toml"), Error) << joint;
  };
  is_refused("a = \"wall\"\nb = \"crate\"\npoint = [1, 0, 0]\n");             // no frequency
  is_refused("a = \"wall\"\nb = \"crate\"\nhertz = 5\n");                     // no point
  is_refused("a = \"crate\"\nb = \"wall\"\npoint = [1, 0, 0]\nhertz = 5\n");  // the crate cannot hold a target
  is_refused("a = \"wall\"\nb = \"crate\"\npoint = [1, 0, 0]\nhertz = 5\ntwist = {}\n");  // no axes
}

}  // namespace
}  // namespace fathom::test::target_joint_test
