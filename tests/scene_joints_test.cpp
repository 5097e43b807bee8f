// Joints in scene files: joints match what the file says, and every mistake gets one error with its location and
// remedy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <utility>

#include "scene/scene_file.hpp"

namespace fathom::scene_joints_test {
namespace {

Scene parse(const std::string& text) { return parse_scene(text, "scene.toml"); }

std::string error_of(const std::string& text) {
  try {
    parse(text);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::file) << error.what();
    return error.what();
  }
  return "(no error)";
}

/// A static `post`, a dynamic `a` half a metre below it and three `link`s, 1 m apart along x.
const std::string jointed = R"([[body]]
name = "post"
motion = "static"
shape = {type = "sphere", radius = 0.1}
position = [0, 0, 2]
[[body]]
name = "a"
shape = {type = "sphere", radius = 0.1}
position = [0, 0, 1.5]
rotation = [0, 0, 1, 0]
[[body]]
name = "link"
shape = {type = "sphere", radius = 0.1}
position = [1, 0, 0]
repeat = {count = [3, 1, 1], spacing = [1, 0, 0]}
)";
std::string joint_with(const std::string& more) { return jointed + "[[joint]]\ntype = \"ball\"\n" + more + "\n"; }

TEST(SceneJoints, JointWithEverything) {
  const Scene scene =
      parse(joint_with("a = \"a\"\nb = \"post\"\nanchor_a = [0, 0.5, 0]\nanchor_b = [1, 2, 3]\n"
                       "hertz = 4\ndamping_ratio = 0.5\ncollide_connected = true\nuser_data = 7"));
  ASSERT_EQ(scene.joints.size(), 1u);
  const SceneJoint& joint = scene.joints[0];
  EXPECT_EQ(joint.def.type, JointType::ball);
  EXPECT_EQ(joint.a, 1u);
  EXPECT_EQ(joint.b, 0u);
  EXPECT_TRUE(joint.def.frame_a.position == (Vec3{0, 0.5f, 0}));
  EXPECT_TRUE(joint.def.frame_b.position == (Vec3{1, 2, 3}));
  EXPECT_EQ(joint.def.hertz, 4.0f);
  EXPECT_EQ(joint.def.damping_ratio, 0.5f);
  EXPECT_TRUE(joint.def.collide_connected);
  EXPECT_EQ(joint.def.user_data, 7u);
}

TEST(SceneJoints, AJointsPointIsThatOfBothBodies) {
  // Joints may precede the bodies; absent values are defaults.
  const Scene scene = parse("[[joint]]\ntype = \"ball\"\na = \"post\"\nb = \"a\"\npoint = [0.5, 0, 2]\n" + jointed);
  ASSERT_EQ(scene.joints.size(), 1u);
  const JointDef& def = scene.joints[0].def;
  EXPECT_TRUE(def.frame_a.position == (Vec3{0.5f, 0, 0}));
  EXPECT_TRUE(def.frame_b.position == (Vec3{-0.5f, 0, -0.5f})) << "half a turn about y";
  EXPECT_EQ(def.hertz, 0.0f);
  EXPECT_FALSE(def.collide_connected);
}

TEST(SceneJoints, RepeatedJointsCountTheBodiesUp) {
  Scene scene = parse(joint_with("a = \"link.0\"\nb = \"link.1\"\npoint = [1.5, 0, 0]\nrepeat = 2"));
  ASSERT_EQ(scene.joints.size(), 2u);
  EXPECT_EQ(scene.joints[1].a, 3u);
  EXPECT_EQ(scene.joints[1].b, 4u);
  EXPECT_TRUE(scene.joints[1].def.frame_a.position == (Vec3{0.5f, 0, 0}));
  EXPECT_TRUE(scene.joints[1].def.frame_b.position == (Vec3{-0.5f, 0, 0}));
  // A body without a number applies to all of them; the point moves along with the other one.
  for (const bool post_first : {true, false}) {
    const std::string bodies = post_first ? "a = \"post\"\nb = \"link.0\"\n" : "a = \"link.0\"\nb = \"post\"\n";
    scene = parse(joint_with(bodies + "point = [1, 0, 1]\nrepeat = 3"));
    ASSERT_EQ(scene.joints.size(), 3u);
    const SceneJoint& last = scene.joints[2];
    EXPECT_EQ(post_first ? last.a : last.b, 0u);
    EXPECT_EQ(post_first ? last.b : last.a, 4u);
    EXPECT_TRUE((post_first ? last.def.frame_b : last.def.frame_a).position == (Vec3{0, 0, 1}));
    EXPECT_TRUE((post_first ? last.def.frame_a : last.def.frame_b).position == (Vec3{3, 0, -1}));
  }
}

/// A joint of `type` from the post to `a`, at the post's centre.
std::string joint_of(const std::string& type, const std::string& more) {
  return jointed + "[[joint]]\ntype = \"" + type + "\"\na = \"post\"\nb = \"a\"\npoint = [0, 0, 2]\n" + more + "\n";
}
JointDef read_joint(const std::string& text) {
  const Scene scene = parse(text);
  EXPECT_EQ(scene.joints.size(), 1u);
  return scene.joints.at(0).def;
}
void expect_near(Vec3 a, Vec3 b) { EXPECT_LT(distance(a, b), 1e-6f) << b.x << " " << b.y << " " << b.z; }

TEST(SceneJoints, JointTypesSetTheirAxes) {
  using enum AxisMode;
  struct Type {
    const char *name, *more;
    std::array<AxisMode, joint_axis_count> modes;
  };
  const Type types[] = {
      {"fixed", "", {locked, locked, locked, locked, locked, locked}},
      {"revolute", "axis = [0, 0, 1]", {locked, locked, locked, free, locked, locked}},
      {"prismatic", "axis = [0, 0, 1]", {free, locked, locked, locked, locked, locked}},
      {"universal", "axis = [0, 0, 1]", {locked, locked, locked, locked, free, free}},
      {"wheel", "axis = [0, 1, 0]\nsuspension = {hertz = 2}", {locked, locked, free, free, locked, locked}},
      {"generic", "", {free, free, free, free, free, free}},
      {"fixed", "z = {mode = \"free\"}", {locked, locked, free, locked, locked, locked}},
  };
  for (const Type& type : types) {
    const JointDef def = read_joint(joint_of(type.name, type.more));
    EXPECT_EQ(def.type, JointType::generic);
    for (std::size_t i = 0; i < joint_axis_count; ++i) EXPECT_EQ(def.axes[i].mode, type.modes[i]) << type.name << i;
  }
}

TEST(SceneJoints, AJointsAxisPointsThereOnBothBodies) {
  const std::pair<const char*, Vec3> axes[] = {{"[0, 0, 1]", {0, 0, 1}},
                                               {"[1, 0, 0]", {1, 0, 0}},
                                               {"[-3, 0, 0]", {-3, 0, 0}},
                                               {"[-1, 1e-3, 0]", {-1, 1e-3f, 0}},
                                               {"[1, 2, -3]", {1, 2, -3}}};
  for (const auto& [text, axis] : axes) {
    const JointDef def = read_joint(joint_of("revolute", "axis = " + std::string(text)));
    const Quat on_a = Quat{0, 0, 1, 0} * def.frame_b.rotation;  // `a` is rotated by half a turn about y
    expect_near(rotate(def.frame_a.rotation, {1, 0, 0}), normalize(axis));
    expect_near(rotate(on_a, {1, 0, 0}), normalize(axis));
    expect_near(rotate(on_a, {0, 1, 0}), rotate(def.frame_a.rotation, {0, 1, 0}));
  }
}

TEST(SceneJoints, JointFrames) {
  const JointDef def = read_joint(jointed +
                                  "[[joint]]\ntype = \"fixed\"\na = \"post\"\nb = \"a\"\n"
                                  "frame_a = {position = [1, 2, 3], rotation = [0, 2, 0, 0]}\n"
                                  "frame_b = {rotation = {axis = [0, 0, 1], angle = 3.1415927}}\n");
  EXPECT_TRUE(def.frame_a.position == (Vec3{1, 2, 3}));
  EXPECT_EQ(def.frame_a.rotation.x, 1.0f);
  EXPECT_TRUE(def.frame_b.position == (Vec3{}));
  EXPECT_NEAR(def.frame_b.rotation.z, 1, 1e-6);
}

TEST(SceneJoints, JointLimitsAndDrives) {
  JointDef def = read_joint(joint_of(
      "generic",
      "axis = [0, 0, 1]\nx = {lower = -1, upper = 2, drive = {position = 0.5, velocity = 2, stiffness = 100, "
      "damping = 7, max_force = 30}}\ny = {drive = {hertz = 3}}\nz = {drive = {damping = inf, max_force = inf}}\n"
      "twist = {mode = \"locked\"}\ncone_angle = 0.5"));
  JointAxis x = JointAxis{}.limit(-1, 2);
  x.drive = {0.5f, 2, 100, 7, 30, false};
  EXPECT_EQ(def.axes[0], x);
  EXPECT_EQ(def.axes[1], JointAxis{}.spring(3, 1));
  EXPECT_EQ(def.axes[2], JointAxis{}.drive_velocity(0, 3e38f));
  EXPECT_EQ(def.axes[3].mode, AxisMode::locked);
  EXPECT_EQ(def.cone_angle, 0.5f);
  def = read_joint(joint_of("revolute", "axis = [0, 0, 1]\nmotor = {velocity = 2, max_force = 50}"));
  EXPECT_EQ(def.axis(JointAxisName::twist), JointAxis{}.drive_velocity(2, 50));
  def = read_joint(joint_of("prismatic", "axis = [0, 0, 1]\nmotor = {velocity = -1}\nx = {lower = 0, upper = 1}"));
  EXPECT_EQ(def.axis(JointAxisName::x), JointAxis{}.limit(0, 1).drive_velocity(-1, 3e38f));
}

TEST(SceneJoints, AWheelsAxesAreItsAxleAndItsSuspensions) {
  const JointDef def = read_joint(
      joint_of("wheel",
               "axis = [0, -1, 0]\nsuspension = {axis = [0, 0, 2], hertz = 3, damping_ratio = 0.5, lower = -0.2, "
               "upper = 0.1}\nsteering = [-0.5, 0.6]\nmotor = {velocity = 9}\nswing_z = {drive = {damping = 4}}"));
  expect_near(rotate(def.frame_a.rotation, {1, 0, 0}), {0, -1, 0});
  expect_near(rotate(def.frame_a.rotation, {0, 0, 1}), {0, 0, 1});
  EXPECT_EQ(def.axis(JointAxisName::z), JointAxis{}.limit(-0.2f, 0.1f).spring(3, 0.5f));
  EXPECT_EQ(def.axis(JointAxisName::twist), JointAxis{}.drive_velocity(9, 3e38f));
  EXPECT_EQ(def.axis(JointAxisName::swing_z), JointAxis{}.limit(-0.5f, 0.6f).drive_position(0, 0, 4));
}

TEST(SceneJoints, DistanceJoints) {
  const auto read = [](const std::string& more) {
    return read_joint(jointed +
                      "[[joint]]\ntype = \"distance\"\na = \"post\"\nb = \"a\"\nanchor_a = [0, 0, 0]\n"
                      "anchor_b = [0, 0, 1]\n" +
                      more + "\n");
  };
  EXPECT_EQ(read("length = 2").type, JointType::distance);
  EXPECT_EQ(read("length = 2").axes[0], JointAxis{}.limit(2, 2));
  EXPECT_EQ(read("upper = 2").axes[0], JointAxis{}.limit(0, 2));
  EXPECT_EQ(read("lower = 1\nupper = 2").axes[0], JointAxis{}.limit(1, 2));
  EXPECT_EQ(read("drive = {position = 1, hertz = 2}").axes[0], JointAxis{}.spring(2, 1, 1));
}

TEST(SceneJoints, RepeatedJointsTurnWithTheirBodies) {
  const std::string turned =
      "[[body]]\nname = \"arm.0\"\nshape = {type = \"sphere\", radius = 0.1}\n"
      "[[body]]\nname = \"arm.1\"\nshape = {type = \"sphere\", radius = 0.1}\n"
      "rotation = [0, 0, 0, 1]\nposition = [1, 0, 0]\n";
  const Scene scene = parse(jointed + turned +
                            "[[joint]]\ntype = \"revolute\"\na = \"post\"\nb = \"arm.0\"\npoint = [0, 0, 0]\n"
                            "axis = [1, 0, 0]\nrepeat = 2\n");
  ASSERT_EQ(scene.joints.size(), 2u);
  for (const SceneJoint& joint : scene.joints) {
    const Quat body = scene.bodies[joint.b].pose.rotation;
    expect_near(rotate(body * joint.def.frame_b.rotation, {1, 0, 0}), {1, 0, 0});
    expect_near(rotate(joint.def.frame_a.rotation, {1, 0, 0}), {1, 0, 0});
  }
}

TEST(SceneJoints, JointsHoldInTheWorld) {
  Scene scene = parse(joint_with("a = \"post\"\nb = \"a\"\npoint = [0, 0, 2]"));
  scene.world.threads = 1;
  World world(scene.world);
  SceneInstance instance(scene, world);
  for (int step = 0; step < 60; ++step) world.step();
  ASSERT_EQ(world.joint_count(), 1u);
  EXPECT_NEAR(world.pose(instance.ids()[1]).position.z, 1.5, 1e-4);
  EXPECT_LT(world.pose(instance.ids()[2]).position.z, -1) << "nothing holds the links";
}

TEST(SceneJoints, AJointThatTheWorldRefusesIsNamed) {
  Scene scene = parse(joint_with("a = \"post\"\nb = \"a\"\npoint = [0, 0, 2]"));
  scene.world.partition = Partition::cells;  // as the command line may set
  World world(scene.world);
  try {
    SceneInstance instance(scene, world);
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::StartsWith("scene: joint 0 between body 0 ('post') and body 1 ('a'): add joint: "
                                                  "the partition `cells` is for contacts alone"));
  }
}

// Mistakes ------------------------------------------------------------------------------------------------------

struct Mistake {
  std::string text;
  std::string error;
};

TEST(SceneJoints, JointMistakes) {
  const std::string pair = "a = \"post\"\nb = \"a\"\n";
  const Mistake mistakes[] = {
      {joint_with(pair + "anchor = [0, 0, 0]"),
       "scene.toml:20:1: unknown key 'anchor' in [[joint]]; did you mean 'anchor_a'?"},
      {joint_with("a = \"pots\"\nb = \"a\""), "scene.toml:18:5: no [[body]] is named 'pots'; did you mean 'post'?"},
      {joint_with("a = \"a\"\nb = \"something\""),
       "scene.toml:19:5: no [[body]] is named 'something'; give one this name"},
      {joint_with("a = \"post\"\nb = \"link\""),
       "scene.toml:19:5: 'link' is repeated; this takes single bodies: name one of 'link.0' to 'link.2'"},
      {joint_with("a = \"post\"\nb = \"link.3\""),
       "scene.toml:19:5: no [[body]] is named 'link.3'; did you mean 'link.0'?"},
      {joint_with("a = \"a\"\nb = \"a\""),
       "scene.toml:19:5: 'a' and 'b' are the same body; a joint holds two different ones together"},
      {joint_with("a = \"a\""), "scene.toml:16:1: [[joint]] needs 'b': the name of a [[body]]"},
      {joint_with("a = 3\nb = \"a\""), "scene.toml:18:5: 'a' must be a string, not an integer"},
      {joint_with(pair),
       "scene.toml:16:1: [[joint]] needs 'anchor_a': in body axes, from the centre of mass (m); or "
       "write 'point', in the world"},
      {joint_with(pair + "anchor_a = [0, 0, 0]"),
       "scene.toml:16:1: [[joint]] needs 'anchor_b': in body axes, from the centre of mass (m); or write 'point', in "
       "the world"},
      {joint_with(pair + "point = [0, 0, 0]\nanchor_b = [0, 0, 0]"),
       "scene.toml:21:12: a joint has either 'point' or 'anchor_b'; remove one"},
      {joint_with(pair + "point = [0, nan, 0]"), "scene.toml:20:13: 'point' must be finite"},
      {joint_with(pair + "point = [0, 0, 0]\nhertz = -1"), "scene.toml:21:9: 'hertz' must not be negative"},
      {joint_with(pair + "point = [0, 0, 0]\ndamping_ratio = 1"),
       "scene.toml:21:17: a rigid joint has no damping ratio; give 'hertz' too, or remove it"},
      {joint_with(pair + "point = [0, 0, 0]\nrepeat = 0"),
       "scene.toml:21:10: 'repeat' must be between 1 and 2147483647, not 0"},
      {joint_with(pair + "point = [0, 0, 0]\nrepeat = 2"),
       "scene.toml:21:10: 'repeat' increases a body's number; name one like 'plank.0' as 'a' or 'b'"},
      {joint_with("a = \"link.0\"\nb = \"link.1\"\npoint = [0, 0, 0]\nrepeat = 3"),
       "scene.toml:21:10: 'repeat' comes to 'link.3', and no [[body]] is named so"},
      {joint_with("a = \"link.1\"\nb = \"link.0\"\npoint = [0, 0, 0]\nrepeat = 3"),
       "scene.toml:21:10: 'repeat' comes to 'link.3', and no [[body]] is named so"},
      {jointed + "[[joint]]\na = \"post\"\n",
       "scene.toml:16:1: [[joint]] needs 'type': write type = \"ball\", \"fixed\", \"revolute\", \"prismatic\", "
       "\"universal\", \"wheel\", \"distance\", \"generic\", \"gear\", \"rack\", \"pulley\" or \"target\""},
      {jointed + "[[joint]]\ntype = \"hinge\"\n",
       "scene.toml:17:8: there is no joint of type 'hinge'; take \"revolute\""},
      {jointed + "[[joint]]\ntype = \"revolut\"\n",
       "scene.toml:17:8: 'revolut' is not a valid type; did you mean 'revolute'?"},
      {jointed + "[joint]\ntype = \"ball\"\n",
       "scene.toml:16:1: write [[joint]] with two brackets: there may be several"},
      {jointed + "[[body]]\nname = \"still\"\nmotion = \"static\"\nshape = {type = \"sphere\", radius = 1}\n"
                 "[[joint]]\ntype = \"ball\"\na = \"post\"\nb = \"still\"\n",
       "scene.toml:23:5: neither 'a' nor 'b' is dynamic; a joint can move dynamic bodies alone"},
      {"[simulator]\npartition = \"cells\"\n" + joint_with(pair + "point = [0, 0, 0]"),
       "scene.toml:18:1: the partition 'cells' is for contacts alone; leave it out of [simulator], or the joints"},
      // Numbers of a repetition are part of ordinary names.
      {jointed + "[[body]]\nname = \"link.1\"\nshape = {type = \"sphere\", radius = 1}\n",
       "scene.toml:17:8: another body is named 'link.1'; names are unique"},
  };
  for (const Mistake& mistake : mistakes) EXPECT_EQ(error_of(mistake.text), mistake.error);
}

TEST(SceneJoints, JointAxisMistakes) {
  const std::string axis = "axis = [0, 0, 1]\n";
  const std::string ends = jointed + "[[joint]]\ntype = \"distance\"\na = \"post\"\nb = \"a\"\nanchor_a = [0, 0, 0]\n" +
                           "anchor_b = [0, 0, 0]\n";
  const Mistake mistakes[] = {
      {joint_of("ball", "twist = {lower = 0, upper = 1}"),
       "scene.toml:21:9: a ball joint has no 'twist'; remove it, or choose another type (fixed, revolute, prismatic, "
       "universal, wheel, generic)"},
      {joint_of("fixed", "motor = {velocity = 1}"),
       "scene.toml:21:9: a fixed joint has no 'motor'; remove it, or choose another type (revolute, prismatic, wheel)"},
      {joint_of("distance", "length = 1"),
       "scene.toml:20:9: a distance joint has no 'point'; remove it, or choose another type (ball, fixed, revolute, "
       "prismatic, universal, wheel, generic, target)"},
      {joint_of("revolute", ""),
       "scene.toml:16:1: [[joint]] needs 'axis': where it points in the world, [x, y, z]; or write 'frame_a' and "
       "'frame_b'"},
      {joint_of("revolute", "axis = [0, 0, 0]"),
       "scene.toml:21:8: 'axis' has no length; give it one of more than 1e-6"},
      {joint_of("revolute", axis + "twist = {lowr = 0}"),
       "scene.toml:22:10: unknown key 'lowr' in twist; did you mean 'lower'?"},
      {joint_of("revolute", axis + "twist = {lower = 0}"),
       "scene.toml:22:9: twist needs 'upper': an axis ends on both sides (rad)"},
      {joint_of("revolute", axis + "twist = {lower = 1, upper = 0}"),
       "scene.toml:22:29: twist: the upper bound is below the lower one"},
      {joint_of("revolute", axis + "twist = {lower = 0, upper = 4}"),
       "scene.toml:22:29: twist: bounds of this angle must lie within -3.1415926 and 3.1415926 rad"},
      {joint_of("universal", axis + "swing_y = {lower = 0, upper = 2}"),
       "scene.toml:22:31: swing_y: bounds of this angle must lie within -1.5707963 and 1.5707963 rad"},
      {joint_of("revolute", axis + "twist = {mode = \"limited\"}"),
       "scene.toml:22:17: a limited axis needs 'lower' and 'upper' (rad)"},
      {joint_of("revolute", axis + "twist = {mode = \"free\", lower = 0, upper = 1}"),
       "scene.toml:22:17: an axis with bounds is limited; remove 'mode', or the bounds"},
      {joint_of("revolute", axis + "x = {drive = {stiffness = 1}}"),
       "scene.toml:22:14: x is locked and cannot be driven; give it mode = \"free\", or bounds apart"},
      {joint_of("revolute", axis + "twist = {drive = {}}"),
       "scene.toml:22:18: a drive needs 'stiffness', 'damping' or 'hertz' greater than 0"},
      {joint_of("revolute", axis + "twist = {drive = {hertz = 1, damping = 1}}"),
       "scene.toml:22:40: a drive has either 'hertz' or 'damping'; remove one"},
      {joint_of("revolute", axis + "twist = {drive = {stiffness = 1, damping_ratio = 1}}"),
       "scene.toml:22:50: 'damping_ratio' goes with 'hertz'; give it too, or 'stiffness' and 'damping' in SI units"},
      {joint_of("revolute", axis + "twist = {drive = {position = 1, damping = 1}}"),
       "scene.toml:22:30: a drive without stiffness goes to no position; give 'stiffness' or 'hertz'"},
      {joint_of("revolute", axis + "twist = {drive = {velocity = 1, stiffness = 1}}"),
       "scene.toml:22:30: a drive without damping keeps no velocity; give 'damping'"},
      {joint_of("revolute", axis + "twist = {drive = {stiffness = inf}}"),
       "scene.toml:22:31: 'stiffness' must be finite"},
      {joint_of("revolute", axis + "motor = {max_force = 3}"),
       "scene.toml:22:9: motor needs 'velocity': its speed (rad/s)"},
      {joint_of("revolute", axis + "motor = {velocity = 3}\ntwist = {drive = {damping = 1}}"),
       "scene.toml:22:9: 'twist' has a drive already; remove it, or 'motor'"},
      {joint_of("revolute", axis + "motor = {velocity = 3}\ntwist = {mode = \"locked\"}"),
       "scene.toml:22:9: twist is locked and cannot be driven; give it mode = \"free\", or bounds apart"},
      {joint_of("generic", "cone_angle = 4"), "scene.toml:21:14: 'cone_angle' must be below 3.1415926 rad"},
      {joint_of("generic", "cone_angle = 1\nswing_z = {lower = 0, upper = 1}"),
       "scene.toml:22:11: a joint has either a 'cone_angle' or 'swing_z'; remove one"},
      {joint_of("revolute", axis + "cone_angle = 1"),
       "scene.toml:22:14: a revolute joint swings about no cone; write type = \"generic\" and lock the other axes"},
      {joint_of("wheel", axis),
       "scene.toml:16:1: [[joint]] needs 'suspension': write suspension = {axis = [0, 0, 1], hertz = 6, damping_ratio "
       "= "
       "0.7}"},
      {joint_of("wheel", axis + "suspension = {hertz = 2}"),
       "scene.toml:22:14: the suspension's axis must be at right angles to the wheel's 'axis'"},
      {joint_of("wheel", axis + "suspension = {lower = 1, upper = 2}"),
       "scene.toml:22:14: suspension needs 'hertz': its frequency (Hz)"},
      {joint_of("wheel", "axis = [0, 1, 0]\nsuspension = {hertz = 2}\nsteering = [1, 0]"),
       "scene.toml:23:12: steering: the upper bound is below the lower one"},
      {joint_of("fixed", "frame_a = {}\nframe_b = {}"),
       "scene.toml:20:9: a joint has either frames or 'point'; remove one"},
      {jointed + "[[joint]]\ntype = \"fixed\"\na = \"post\"\nb = \"a\"\nframe_a = {}\n",
       "scene.toml:16:1: [[joint]] needs 'frame_b': write {position = [x, y, z], rotation = [w, x, y, z]}, in body "
       "axes "
       "from the centre of mass (m); x is the joint's axis"},
      {ends, "scene.toml:16:1: a distance joint needs 'length', 'upper' or 'drive'"},
      {ends + "lower = 1", "scene.toml:22:9: 'lower' needs 'upper', the longest distance (m)"},
      {ends + "lower = 2\nupper = 1", "scene.toml:23:9: distance: the upper bound is below the lower one"},
      {ends + "length = 1\nupper = 1",
       "scene.toml:22:10: a distance joint has either 'length' or 'lower' and 'upper'; remove one"},
      {ends + "length = 1\ndrive = {hertz = 1}",
       "scene.toml:23:9: the distance is locked and cannot be driven; give it mode = \"free\", or bounds apart"},
      {ends + "length = -1", "scene.toml:22:10: 'length' must not be negative"},
  };
  for (const Mistake& mistake : mistakes) EXPECT_EQ(error_of(mistake.text), mistake.error);
}

TEST(SceneJoints, BreakingRestitutionAndArmature) {
  const Scene scene = parse(joint_of("revolute",
                                     "axis = [0, 0, 1]\nbreak_force = 100\nbreak_torque = 20\n"
                                     "twist = {lower = -1, upper = 1, restitution = 0.5, armature = 2}"));
  const JointDef& def = scene.joints.at(0).def;
  EXPECT_EQ(def.break_force, 100);
  EXPECT_EQ(def.break_torque, 20);
  EXPECT_EQ(def.axis(JointAxisName::twist).restitution, 0.5f);
  EXPECT_EQ(def.axis(JointAxisName::twist).armature, 2);
}

std::string coupling_of(const std::string& type, const std::string& more) {
  return jointed + "[[joint]]\ntype = \"" + type + "\"\na = \"a\"\nb = \"link.0\"\n" + more + "\n";
}

TEST(SceneJoints, Couplings) {
  const JointDef gear =
      parse(coupling_of("gear", "axis_a = [1, 0, 0]\naxis_b = [0, 2, 0]\nratio = -3")).joints.at(0).def;
  EXPECT_EQ(gear.type, JointType::coupling);
  EXPECT_EQ(gear.ratio, -3);
  EXPECT_EQ(gear.coupled_a.motion, CoupledMotion::turn);
  const JointDef rack =
      parse(coupling_of("rack", "axis = [1, 0, 0]\ndirection = [0, 1, 0]\nradius = 0.25")).joints.at(0).def;
  EXPECT_EQ(rack.ratio, -4);
  EXPECT_EQ(rack.coupled_b.motion, CoupledMotion::slide);
  const JointDef pulley =
      parse(coupling_of("pulley", "wheel_a = [0, 0, 4]\nwheel_b = [1, 0, 5]\nratio = 2\nbreak_force = 9"))
          .joints.at(0)
          .def;
  EXPECT_EQ(pulley.axis(JointAxisName::x).upper, 2.5f + 2 * 5);
  EXPECT_EQ(pulley.break_force, 9);
  EXPECT_TRUE(pulley.collide_connected);
  EXPECT_EQ(parse(coupling_of("pulley", "wheel_a = [0, 0, 4]\nwheel_b = [1, 0, 5]\nlength = 6"))
                .joints.at(0)
                .def.axis(JointAxisName::x)
                .upper,
            6);
}

TEST(SceneJoints, CouplingMistakes) {
  const Mistake mistakes[] = {
      {coupling_of("gear", "axis = [1, 0, 0]"),
       "scene.toml:16:1: [[joint]] needs 'ratio': how often A turns, backwards, for one turn of B"},
      {coupling_of("gear", "axis = [1, 0, 0]\nratio = 0"), "scene.toml:21:9: 'ratio' must not be 0"},
      {coupling_of("gear", "axis = [0, 0, 0]\nratio = 2"),
       "scene.toml:20:8: 'axis' has no length; give it one of more than 1e-6"},
      {coupling_of("rack", "axis = [1, 0, 0]\ndirection = [0, 1, 0]\nradius = 0"),
       "scene.toml:22:10: 'radius' must not be 0; below 0 the rack moves backwards"},
      {coupling_of("pulley", "wheel_a = [0, 0, 4]\nwheel_b = [0, 0, 4]\nratio = -1"),
       "scene.toml:22:9: a rope's 'ratio' must be greater than 0"},
      {coupling_of("gear", "axis = [1, 0, 0]\nratio = 2\nrepeat = 2"),
       "scene.toml:22:10: a gear joint has no 'repeat'; remove it, or choose another type (ball, fixed, revolute, "
       "prismatic, universal, wheel, distance, generic)"},
      {joint_of("revolute", "axis = [0, 0, 1]\ntwist = {restitution = 0.5}"),
       "scene.toml:22:24: an axis without limits has no restitution; limit it by a lower and an upper bound"},
      {joint_of("revolute", "axis = [0, 0, 1]\nx = {armature = 1}"),
       "scene.toml:22:17: an axis that is locked has no armature; leave it 0"},
      {joint_of("revolute", "axis = [0, 0, 1]\nbreak_force = -1"),
       "scene.toml:22:15: 'break_force' must not be negative"},
  };
  for (const Mistake& mistake : mistakes) EXPECT_EQ(error_of(mistake.text), mistake.error);
}

// The example ---------------------------------------------------------------------------------------------------

TEST(SceneJoints, TheExampleOfMechanismsWorks) {
  Scene scene = load_scene(FATHOM_SOURCE_DIR "/examples/scenes/mechanisms.toml");
  scene.world.threads = 1;
  World world(scene.world);
  SceneInstance instance(scene, world);
  const auto find = [&](std::string_view name) {
    for (const NamedBody& named : scene.names)
      if (named.name == name) return instance.ids()[named.body];
    ADD_FAILURE() << name;
    return BodyId{};
  };
  const auto joint_of_body = [&](std::string_view name) {
    for (const JointId id : world.joints())
      if (world.joint(id).b == find(name)) return id;
    ADD_FAILURE() << name;
    return JointId{};
  };
  const auto position = [&](std::string_view name, JointAxisName axis) {
    return world.joint_positions(joint_of_body(name))[static_cast<std::size_t>(axis)];
  };
  const Vec3 start = world.pose(find("chassis")).position;
  float widest_door = 0, farthest = 0, nearest = 9, longest = 0, driven = 0;
  for (int step = 0; step < 600; ++step) {
    instance.prepare_step();
    world.step();
    widest_door = max(widest_door, position("door", JointAxisName::twist));
    const float slider = world.pose(find("slider")).position.x;
    farthest = max(farthest, slider), nearest = min(nearest, slider);
    longest = max(longest, position("weight", JointAxisName::x));
    driven = max(driven, distance(world.pose(find("chassis")).position, start));
    EXPECT_GT(rotate(world.pose(find("chassis")).rotation, {0, 0, 1}).z, 0.9f) << step;
  }
  EXPECT_NEAR(widest_door, 1.9f, 0.02f) << "it swings to its limit";
  EXPECT_NEAR(position("door", JointAxisName::twist), 0, 0.05f) << "and is shut again";
  EXPECT_NEAR(world.velocity(find("rotor")).angular.z, 3, 0.01f);
  EXPECT_GT(driven, 5) << "across its circle";
  EXPECT_NEAR(world.pose(find("chassis")).position.z, 0.61f, 0.03f) << "on its springs";
  EXPECT_NEAR(farthest, 1.8f, 0.01f);
  EXPECT_NEAR(nearest, 1.0f, 0.01f);
  EXPECT_NEAR(longest, 2.2f, 0.02f);
  EXPECT_NEAR(world.pose(find("platform")).position.z, 1 - 60 * 9.81f / 4000, 0.01f);
  EXPECT_TRUE(world.quarantined().empty());
}

TEST(SceneJoints, TheExampleOfCouplingsWorks) {
  Scene scene = load_scene(FATHOM_SOURCE_DIR "/examples/scenes/couplings.toml");
  scene.world.threads = 1;
  World world(scene.world);
  SceneInstance instance(scene, world);
  const auto find = [&](std::string_view name) {
    for (const NamedBody& named : scene.names)
      if (named.name == name) return instance.ids()[named.body];
    ADD_FAILURE() << name;
    return BodyId{};
  };
  std::size_t broken = 0;
  for (int step = 0; step < 60; ++step) {
    instance.prepare_step();
    world.step();
    broken += world.joints_broken().size();
  }
  EXPECT_EQ(broken, 1u);
  EXPECT_NEAR(world.velocity(find("pinion")).angular.x, 3, 0.05f);
  EXPECT_NEAR(world.velocity(find("wheel")).angular.x, -1, 0.02f);
  EXPECT_NEAR(world.velocity(find("rack")).linear.y, 0.35f, 0.01f);
  EXPECT_NEAR(world.velocity(find("heavy")).linear.z, -9.81f / 9, 0.01f);
  EXPECT_NEAR(world.pose(find("weight")).position.z, 0.2f, 0.02f) << "on the ground";
}

}  // namespace
}  // namespace fathom::scene_joints_test
