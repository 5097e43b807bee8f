// Every parameter of a joint changes while it runs, on every simulator; joints are found by their user data.
#include <gtest/gtest.h>

#include <algorithm>

#include "joint_worlds.hpp"

namespace fathom::test::joint_changes_test {
namespace {

class JointChanges : public OfJointWorlds {};
INSTANTIATE_TEST_SUITE_P(World, JointChanges, testing::ValuesIn(joint_worlds), joint_world_name);

/// A weightless box that a hinge turns about x through its centre, at 2 rad/s.
struct Turned {
  World world;
  BodyId post, box;
  JointId joint;

  static WorldDef weightless(const JointWorlds& worlds) {
    WorldDef def = worlds.quiet();
    def.gravity = {};
    return def;
  }
  explicit Turned(const JointWorlds& worlds) : world(weightless(worlds)) {
    post = add_anchor(world, {});
    box = world.add(dynamic(fathom::box({0.5f, 0.4f, 0.3f}), {}, 2));
    JointDef hinge = revolute_joint(post, box, {}, {});
    hinge.axis(JointAxisName::twist).drive_velocity(2, 1e4f);
    hinge.user_data = 5;
    joint = world.add_joint(hinge);
  }
  void step(int count) {
    for (int i = 0; i < count; ++i) world.step();
  }
};

// A hinge becomes a slider with a motor, at once, as with the functions for single parameters.
TEST_P(JointChanges, AllAtOnceIsWhatTheyAreOneByOne) {
  Turned at_once(GetParam()), singly(GetParam());
  for (Turned* t : {&at_once, &singly}) {
    t->step(30);
    EXPECT_NEAR(t->world.velocity(t->box).angular.x, 2, 1e-3f);
  }
  const Pose frame_b{{0.1f, 0, 0}, 0, {}};
  JointDef slider = prismatic_joint({}, {}, {}, frame_b);
  slider.axis(JointAxisName::x).drive_velocity(1, 1e4f);
  slider.axis(JointAxisName::twist).limit(-3, 3);
  slider.axis(JointAxisName::twist).drive_velocity(0, 1e4f);
  slider.break_force = 1e6f, slider.user_data = 5;
  at_once.world.change_joint(at_once.joint, slider);
  for (const JointAxisName name : {JointAxisName::x, JointAxisName::twist})
    singly.world.set_joint_axis(singly.joint, name, slider.axis(name));
  singly.world.set_joint_frames(singly.joint, {}, frame_b);
  singly.world.set_joint_break(singly.joint, 1e6f, unbreakable);
  for (Turned* t : {&at_once, &singly}) {
    t->step(30);
    EXPECT_NEAR(t->world.velocity(t->box).linear.x, 1, 1e-3f);
    EXPECT_NEAR(t->world.velocity(t->box).angular.x, 0, 1e-3f);
  }
  EXPECT_EQ(at_once.world.state_hash(), singly.world.state_hash());
  EXPECT_EQ(at_once.world.joint(at_once.joint).a, at_once.post);
}

// What is solved directly depends on it: a joint of a hanging chain that became soft stayed rigid.
TEST_P(JointChanges, RigidOnesBecomeSoftAndBack) {
  for (const float hertz : {0.0f, 2.0f}) {
    World changed(GetParam().quiet()), always(GetParam().quiet());
    const auto hang = [](World& world, float begins_with) {
      const Chain chain(world, add_anchor(world, {}), {}, {0, 0, -1}, 4);
      world.set_joint_spring(chain.joints[1], begins_with, 1);
      return chain;
    };
    const Chain chain = hang(changed, 2 - hertz);
    hang(always, hertz);
    for (int i = 0; i < 10; ++i) changed.step();
    changed.set_joint_spring(chain.joints[1], hertz, 1);
    changed.step();
    World copy(changed.definition());
    std::vector<std::byte> bytes;
    changed.save(bytes);
    copy.restore(bytes);
    for (int i = 0; i < 600; ++i) changed.step(), copy.step(), always.step();
    EXPECT_EQ(copy.state_hash(), changed.state_hash()) << hertz << " Hz";
    EXPECT_NEAR(changed.pose(chain.links[3]).position.z, always.pose(chain.links[3]).position.z, 1e-3f);
    EXPECT_EQ(gap_of(changed, chain.joints[1]) > 0.05f, hertz > 0) << gap_of(changed, chain.joints[1]);
  }
}

// Equal mechanisms are solved side by side, as long as they are equal.
TEST_P(JointChanges, OneOfEqualMechanismsChanges) {
  using Change = void (*)(JointAxis&);
  for (const Change change :
       {Change{[](JointAxis& axis) { axis.armature = 5; }}, Change{[](JointAxis& axis) { axis.spring(2, 0.1f); }},
        Change{[](JointAxis& axis) { axis.restitution = 0.8f; }}}) {
    WorldDef def = GetParam().quiet();
    def.gravity = {};
    World changed(def), always(def);
    std::vector<BodyId> links;
    std::vector<JointId> joints;
    JointDef hinge =
        revolute_joint({}, {}, joint_frame({0, 0.25f, 0}, {1, 0, 0}), joint_frame({0, -0.25f, 0}, {1, 0, 0}));
    hinge.axis(JointAxisName::twist).limit(-0.3f, 0.3f).drive_position(0, 50, 5);
    for (World* world : {&changed, &always}) {
      links.clear(), joints.clear();
      for (int i = 0; i < 8; ++i) {
        hinge.a = add_anchor(*world, {static_cast<float>(i), 0, 0});
        for (int k = 0; k < 3; ++k) {
          const Vec3 at{static_cast<float>(i), 0.5f + 0.5f * static_cast<float>(k), 0};
          hinge.b = world->add(dynamic(box({0.1f, 0.2f, 0.1f}), at, 10));
          joints.push_back(world->add_joint(hinge));
          links.push_back(hinge.a = hinge.b);
        }
      }
    }
    JointAxis axis = hinge.axis(JointAxisName::twist);
    change(axis);
    always.set_joint_axis(joints[10], JointAxisName::twist, axis);
    for (World* world : {&changed, &always}) world->step();
    changed.set_joint_axis(joints[10], JointAxisName::twist, axis);
    for (World* world : {&changed, &always}) world->set_gravity({0, 0, -9.81f});
    float effect = 0;
    for (int i = 0; i < 30; ++i) {
      changed.step(), always.step();
      effect =
          std::max(effect, length(changed.pose(links[11]).position - changed.pose(links[8]).position - Vec3{1, 0, 0}));
    }
    for (const BodyId link : links)
      EXPECT_NEAR(changed.pose(link).position.z, always.pose(link).position.z, 1e-5f) << link.index;
    EXPECT_GT(effect, 0.002f);
  }
}

TEST_P(JointChanges, RefuseWhatTheyCannotBe) {
  Turned t(GetParam());
  JointDef bad = t.world.joint(t.joint);
  bad.axis(JointAxisName::twist).restitution = 0.5f;
  EXPECT_THROW(t.world.change_joint(t.joint, bad), Error);
  EXPECT_THROW(t.world.change_joint(t.joint, ball_joint({}, {}, {}, {})), Error);
  bad = t.world.joint(t.joint);
  bad.collide_connected = true;
  EXPECT_THROW(t.world.change_joint(t.joint, bad), Error);
  t.step(30);
  EXPECT_NEAR(t.world.velocity(t.box).angular.x, 2, 1e-3f) << "it is as it was";
  t.world.remove_joint(t.joint);
  EXPECT_THROW(t.world.change_joint(t.joint, bad), Error);
}

TEST_P(JointChanges, JointsAreFoundByUserData) {
  Turned t(GetParam());
  JointDef second = ball_joint(t.post, t.box, {}, {});
  second.user_data = 6;
  const JointId other = t.world.add_joint(second);
  EXPECT_EQ(t.world.find_joint(t.post, t.box, 5), t.joint);
  EXPECT_EQ(t.world.find_joint(t.post, t.box, 6), other);
  EXPECT_THROW(t.world.find_joint(t.box, t.post, 5), Error) << "from the one to the other";
  EXPECT_THROW(t.world.find_joint(t.post, t.box, 7), Error);
  t.world.remove(t.box);
  EXPECT_THROW(t.world.find_joint(t.post, t.box, 5), Error);
}

// One rule for worlds and scene files (see scene_joints_test.cpp), with one message.
TEST(JointRules, AxesWithoutLimitsHaveNoRestitutionAndLockedOnesNoArmature) {
  World world(quiet_world());
  const BodyId a = add_anchor(world, {}), b = world.add(dynamic(box({0.5f, 0.5f, 0.5f}), {0, 0, 3}));
  const auto refusal = [&](JointAxisName name, auto change) {
    JointDef def = revolute_joint(a, b, {}, {});
    change(def.axis(name));
    try {
      world.add_joint(def);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("(none)");
  };
  EXPECT_EQ(refusal(JointAxisName::twist, [](JointAxis& axis) { axis.restitution = 0.5f; }),
            "add joint: axis twist: an axis without limits has no restitution; limit it by a lower and an upper bound");
  EXPECT_EQ(refusal(JointAxisName::x, [](JointAxis& axis) { axis.armature = 1; }),
            "add joint: axis x: an axis that is locked has no armature; leave it 0");
  EXPECT_EQ(refusal(JointAxisName::twist, [](JointAxis& axis) { axis.limit(0.2f, 0.2f).armature = 1; }),
            "add joint: axis twist: an axis that is locked has no armature; leave it 0");
  EXPECT_EQ(refusal(JointAxisName::twist, [](JointAxis& axis) { axis.limit(-1, 1).restitution = 1; }), "(none)");
}

TEST(JointRules, FramesGearsAndRacksNeedAnAxis) {
  const Vec3 x{1, 0, 0};
  EXPECT_THROW(joint_frame({}, {}), Error);
  EXPECT_THROW(gear_joint({}, {}, {}, {}, {}, x, 2), Error);
  EXPECT_THROW(gear_joint({}, {}, x, {}, {}, {1e-7f, 0, 0}, 2), Error);
  EXPECT_THROW(rack_joint({}, {}, x, {}, {}, {}, 2), Error);
  EXPECT_NO_THROW(joint_frame({}, {1e-5f, 0, 0}));
}

}  // namespace
}  // namespace fathom::test::joint_changes_test
