// What the controls do to a world, without a window.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "scene/environments.hpp"
#include "test_folder.hpp"
#include "viewer/controls.hpp"
#include "viewer/overlays.hpp"
#include "viewer/preferences.hpp"
#include "viewer/session.hpp"

namespace fathom::viewer::viewer_test {
namespace {

Scene make(const Choice& choice) {
  const Environment* environment = find_environment(choice.scene);
  if (!environment) throw Error(ErrorCode::invalid_argument, "there is no " + choice.scene);
  Scene scene = environment->make(choice.bodies.value_or(50));
  scene.world.threads = 1;
  return scene;
}

TEST(Session, AnotherSceneBeginsAnew) {
  Session session(make, {.scene = "pyramid"});
  session.step();
  EXPECT_EQ(session.history().size(), 1u);
  session.choose({.scene = "spread", .bodies = 9});
  EXPECT_EQ(session.world().body_count(), 10u);
  EXPECT_EQ(session.world().step_count(), 0u);
  EXPECT_TRUE(session.history().empty());
}

TEST(Session, AChoiceThatCannotBeLeavesTheOldScene) {
  Session session(make, {.scene = "pyramid"});
  session.step();
  EXPECT_THROW(session.choose({.scene = "nothing"}), Error);
  EXPECT_EQ(session.choice().scene, "pyramid");
  session.step();
  EXPECT_EQ(session.world().step_count(), 2u);
}

TEST(Session, AGrabbedBodyFollowsTheHand) {
  Session session(make, {.scene = "spread", .bodies = 1});
  for (int i = 0; i < 30; ++i) session.step();
  const BodyId cube = session.world().bodies()[1];
  ASSERT_TRUE(session.grab({0, -10, 1}, {0, 1, 0}));
  EXPECT_EQ(session.grip()->body, cube);
  // The hand moves to where a ray passes 2 m higher and 3 m to the right at the same depth.
  const Vec3 aim = normalize(session.grip()->hand + Vec3{3, 0, 2} - Vec3{0, -10, 1});
  session.drag({0, -10, 1}, aim, {0, 1, 0});
  for (int i = 0; i < 120; ++i) session.step();
  const Vec3 point = transform(session.world().pose(cube), session.grip()->anchor);
  EXPECT_LT(distance(point, session.grip()->hand), 0.1f);
  EXPECT_GT(session.world().pose(cube).position.x, 2.5f);
  session.release();
  for (int i = 0; i < 240; ++i) session.step();
  EXPECT_NEAR(session.world().pose(cube).position.z, 1.0f, 0.01f);  // it has fallen back to the ground
}

// The hand's joint and the body that holds it come and go with it.
TEST(Session, LettingGoLeavesNothingBehind) {
  Session session(make, {.scene = "spread", .bodies = 1});
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(session.grab({0, -10, 1}, {0, 1, 0}));
    session.step();
    EXPECT_EQ(session.world().joint_count(), 1u);
  }
  session.release();
  session.step();
  EXPECT_EQ(session.world().joint_count(), 0u);
  EXPECT_EQ(session.world().body_count(), 2u);
}

TEST(Session, AWorldWithoutJointsIsPulledByAForce) {
  const auto with_cells = [](const Choice& choice) {
    Scene scene = make(choice);
    scene.world.partition = Partition::cells;
    return scene;
  };
  Session session(with_cells, {.scene = "spread", .bodies = 1});
  ASSERT_TRUE(session.grab({0, -10, 1}, {0, 1, 0}));
  const Vec3 aim = normalize(session.grip()->hand + Vec3{0, 0, 2} - Vec3{0, -10, 1});
  session.drag({0, -10, 1}, aim, {0, 1, 0});
  for (int i = 0; i < 300; ++i) session.step();
  const Pose& pose = session.world().pose(session.grip()->body);
  EXPECT_LT(distance(transform(pose, session.grip()->anchor), session.grip()->hand), 0.1f);
  EXPECT_EQ(session.world().joint_count(), 0u);
}

TEST(Session, TheGroundCannotBeGrabbed) {
  Session session(make, {.scene = "spread", .bodies = 1});
  EXPECT_FALSE(session.grab({20, 0, 10}, {0, 0, -1}));
  EXPECT_FALSE(session.grab({20, 0, 10}, {0, 0, 1}));
}

TEST(Session, AShotBoxKnocksThePyramidOver) {
  Session session(make, {.scene = "pyramid"});
  for (int i = 0; i < 30; ++i) session.step();
  const BodyId top = session.world().bodies().back();
  const Vec3 before = session.world().pose(top).position;
  session.shoot(before + Vec3{-6, 0, 0.1f}, {1, 0, 0});
  for (int i = 0; i < 60; ++i) session.step();
  EXPECT_GT(distance(session.world().pose(top).position, before), 1);
}

TEST(Session, AGrabbedBodyThatIsRemovedIsLetGo) {
  Session session(make, {.scene = "spread", .bodies = 1});
  ASSERT_TRUE(session.grab({0, -10, 1}, {0, 1, 0}));
  session.world().remove(session.grip()->body);
  session.step();
  EXPECT_FALSE(session.grip());
}

TEST(Session, WhatWasDoneIsUndone) {
  Session session(make, {.scene = "pyramid"});
  EXPECT_FALSE(session.undo());
  for (int i = 0; i < 30; ++i) session.step();
  const std::uint64_t before = session.world().state_hash();
  const auto next_hash = [&] {
    session.step();
    return session.world().state_hash();
  };
  session.remember();
  const std::uint64_t next = next_hash();
  ASSERT_TRUE(session.undo());
  EXPECT_EQ(session.world().state_hash(), before);

  session.shoot({-6, 0, 2}, {1, 0, 0});
  for (int i = 0; i < 10; ++i) session.step();
  ASSERT_TRUE(session.undo());
  EXPECT_EQ(session.world().state_hash(), before);

  ASSERT_TRUE(session.grab({0.5f, -20, 1}, {0, 1, 0}));
  session.step();
  session.shoot({-6, 0, 2}, {1, 0, 0});
  ASSERT_TRUE(session.undo());
  EXPECT_EQ(session.world().joint_count(), 0u) << "what the hand holds on to does not come back";
  ASSERT_TRUE(session.undo());
  EXPECT_EQ(session.world().state_hash(), before);

  session.choose({.scene = "spread", .bodies = 9});
  session.step();
  ASSERT_TRUE(session.undo());
  EXPECT_EQ(session.choice().scene, "pyramid");
  EXPECT_EQ(session.world().state_hash(), before);
  EXPECT_EQ(next_hash(), next) << "as if nothing had been";
}

TEST(Session, KickedScenesGoOnAsBeforeWhenUndone) {
  Session session(make, {.scene = "drift"});
  for (int i = 0; i < 45; ++i) session.step();
  const auto run = [&] {
    for (int i = 0; i < 45; ++i) session.step();
    return session.world().state_hash();
  };
  session.remember();
  const std::uint64_t end = run();
  ASSERT_TRUE(session.undo());
  EXPECT_EQ(run(), end);
}

TEST(ViewerPreferences, AreKeptAndNobodyElsesAreBelieved) {
  const test::TestFolder folder;
  const std::string path = folder / "fathom/viewer.toml";
  EXPECT_EQ(load_preferences(path), Preferences{});
  Preferences set{900, 700, 0.25f, false, parse_overlays("joints,through"), render::Colouring::island, {}};
  for (const auto look : {std::optional<render::LookKind>(), {render::LookKind::daylight}, {render::LookKind::water}}) {
    set.look = look;
    save_preferences(path, set);
    EXPECT_EQ(load_preferences(path), set);
  }
  std::ofstream(path) << "width = -3\nspeed = nan\nheight = 700\ncolouring = 77\nlook = 2\nboxes\n\x01 = 1\n";
  Preferences some;
  some.height = 700;
  EXPECT_EQ(load_preferences(path), some);
}

class Overlays : public testing::TestWithParam<SimulatorKind> {};

TEST_P(Overlays, ShowContactsWithTheirColours) {
  const auto make_on = [](const Choice& choice) {
    Scene scene = make(choice);
    scene.world.simulator = *choice.simulator;
    scene.world.device = "host";
    return scene;
  };
  Session session(make_on, {.scene = "pyramid", .bodies = 5, .simulator = GetParam()});
  for (int i = 0; i < 20; ++i) session.step();
  std::size_t points = 0, contacts = 0;
  session.world().for_each_contact([&](const ContactInfo& contact) {
    points += static_cast<std::size_t>(contact.point_count);
    ++contacts;
    EXPECT_GE(contact.colour, 0);
  });
  ASSERT_GT(points, 0u);
  OverlayMarks marks;
  add_overlays(session.world(), parse_overlays("points,through"), marks);
  EXPECT_EQ(marks.on_top.size(), points);
  add_overlays(session.world(), parse_overlays("graph,normals,impulses,boxes,through"), marks);
  EXPECT_EQ(marks.on_top.size(), points + contacts + 2 * points + 12 * 5u);
  EXPECT_TRUE(marks.hidden.empty());
  OverlayMarks behind;
  add_overlays(session.world(), parse_overlays("points,graph,boxes"), behind);
  EXPECT_EQ(behind.hidden.size(), points + contacts + 12 * 5u) << "bodies hide them";
  EXPECT_TRUE(behind.on_top.empty());
}

// A ball hangs on a spring half a metre below a fixed one.
TEST_P(Overlays, ShowJointsAndWhatTheyCarry) {
  const auto make_on = [](const Choice& choice) {
    Scene scene;
    scene.world.simulator = *choice.simulator;
    scene.world.device = "host";
    BodyDef ball;
    ball.shape = sphere(0.1f);
    ball.pose.position = {0, 0, 2};
    ball.motion = MotionType::fixed;
    scene.bodies.push_back(ball);
    ball.pose.position = {0, 0, 1.5f};
    ball.motion = MotionType::dynamic;
    scene.bodies.push_back(ball);
    scene.joints.push_back({0, 1, ball_joint({}, {}, {}, {0, 0, 0.5f})});
    scene.joints[0].def.hertz = 2;
    return scene;
  };
  Session session(make_on, {.scene = "ball", .simulator = GetParam()});
  for (int i = 0; i < 200; ++i) session.step();
  OverlayMarks marks;
  add_overlays(session.world(), parse_overlays("joints,through"), marks);
  ASSERT_EQ(marks.on_top.size(), 4u) << "an arm of the ball that moves, the gap, two anchors";
  const Vec3 centre = session.world().poses()[1].position, anchor = centre + Vec3{0, 0, 0.5f};
  EXPECT_LT(distance(marks.on_top[0].a, centre) + distance(marks.on_top[0].b, anchor), 1e-3f);
  const float sag = distance(marks.on_top[1].a, marks.on_top[1].b);
  EXPECT_NEAR(sag, 9.81f / (4 * pi * 4 * pi), 1e-3f);
  EXPECT_LT(distance(marks.on_top[2].a, {0, 0, 2}), 1e-6f);
  marks = {};
  add_overlays(session.world(), parse_overlays("reactions,through"), marks);
  ASSERT_EQ(marks.on_top.size(), 1u);
  EXPECT_LT(distance(marks.on_top[0].a, anchor), 1e-3f);
  EXPECT_LT(distance(marks.on_top[0].b, anchor + Vec3{0, 0, 0.5f}), 5e-3f) << "it carries the ball's weight";
}

TEST(JointMarks, ShowAxesAndLimits) {
  World world;
  BodyDef def;
  def.shape = sphere(0.1f);
  def.motion = MotionType::fixed;
  const BodyId post = world.add(def);
  def.motion = MotionType::dynamic;
  def.pose.position = {1, 0, 0};
  const BodyId ball = world.add(def);
  const Pose on_ball{{-1, 0, 0}, 0, {}};
  const auto marks_of = [&](const JointDef& joint) {
    const JointId id = world.add_joint(joint);
    OverlayMarks marks;
    add_overlays(world, parse_overlays("joints,through"), marks);
    world.remove_joint(id);
    return marks.on_top;
  };
  const std::size_t plain = marks_of(fixed_joint(post, ball, {}, on_ball)).size();
  EXPECT_EQ(plain, 4u) << "an arm, the gap, two anchors";
  JointDef joint = revolute_joint(post, ball, {}, on_ball);
  EXPECT_EQ(marks_of(joint).size(), plain + 1) << "the axis";
  joint.axis(JointAxisName::twist).limit(0, 1);
  EXPECT_EQ(marks_of(joint).size(), plain + 4) << "and where it begins, ends and stands";
  joint = prismatic_joint(post, ball, {}, {});
  joint.axis(JointAxisName::x).limit(-2, 3);
  std::vector<render::Mark> marks = marks_of(joint);
  EXPECT_EQ(marks.size(), plain + 2) << "the way and its ends; no gap, since its anchors need not meet";
  EXPECT_LT(distance(marks[1].a, {-2, 0, 0}) + distance(marks[1].b, {3, 0, 0}), 1e-6f);
  // With the bodies swapped, the axes are still those of the fixed body, and the ball is at -1.
  std::swap(joint.a, joint.b);
  marks = marks_of(joint);
  EXPECT_LT(distance(marks[1].a, {2, 0, 0}) + distance(marks[1].b, {-3, 0, 0}), 1e-6f);
  joint = universal_joint(post, ball, {}, on_ball);
  EXPECT_EQ(marks_of(joint).size(), plain + 2) << "two axes";
  joint.cone_angle = 0.5f;
  EXPECT_EQ(marks_of(joint).size(), plain + 9) << "eight rays of the cone, and the axis in it";
  EXPECT_EQ(marks_of(distance_joint(post, ball, {}, {}, 0, 2)).size(), plain) << "a line between the anchors";
}

INSTANTIATE_TEST_SUITE_P(Both, Overlays, testing::Values(SimulatorKind::native, SimulatorKind::device));

TEST(OverlayNames, UnknownOnesAreRefusedWithAGuess) {
  try {
    parse_overlays("points,normls");
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("did you mean 'normals'?"));
  }
}

TEST(Controls, KeepTheTargetInTheMiddle) {
  CameraControls controls;
  controls.look_at({{-1, -1, 0}, {1, 1, 2}}, 1.6f);
  const render::Camera before = controls.camera();
  controls.orbit(200, -5000);
  controls.zoom(3);
  const render::Camera after = controls.camera();
  EXPECT_EQ(after.target, before.target);
  EXPECT_LT(distance(after.eye, after.target), distance(before.eye, before.target));
  EXPECT_LT(after.eye.z, after.target.z);  // from below, but never over the pole
}

}  // namespace
}  // namespace fathom::viewer::viewer_test
