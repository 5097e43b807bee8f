// Scene files: scenes match what the file says, and every mistake gets one error with its location and remedy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "scene/scene_file.hpp"

namespace fathom::scene_test {
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

/// A body that is valid except for what `more` adds.
std::string body_with(const std::string& more) {
  return "[[body]]\nshape = {type = \"sphere\", radius = 0.5}\n" + more + "\n";
}

TEST(SceneFile, WorldSolverSleepAndSimulator) {
  const Scene scene = parse(R"(
name = "everything"
[world]
gravity = [0, 0.5, -1.62]
dt = 0.01
max_bodies = 100
ground_height = 0.25
[solver]
method = "impulse"
substeps = 2
iterations = 20
contact_hertz = 40.0
contact_damping_ratio = 5
push_out_velocity = 2.0
restitution_threshold = 0.5
max_linear_speed = 200.0
[sleep]
enabled = false
linear_speed = 0.1
time = 1.0
[simulator]
kind = "native"
threads = 3
broad_phase = "sweep"
sweep_axis = [1, 0, 0]
[kicks]
interval = 10
linear = 0.25
angular = 0.125
seed = 7
)" + body_with(""));
  EXPECT_EQ(scene.name, "everything");
  EXPECT_EQ(scene.world.simulator, SimulatorKind::native);
  EXPECT_TRUE(scene.world.gravity == (Vec3{0, 0.5f, -1.62f}));
  EXPECT_EQ(scene.world.dt, 0.01f);
  EXPECT_EQ(scene.world.max_bodies, 100u);
  EXPECT_EQ(scene.ground_height, 0.25f);
  EXPECT_EQ(scene.world.solver.method, Solver::impulse);
  EXPECT_EQ(scene.world.solver.substeps, 2);
  EXPECT_EQ(scene.world.solver.iterations, 20);
  EXPECT_EQ(scene.world.solver.contact_hertz, 40.0f);
  EXPECT_EQ(scene.world.solver.contact_damping_ratio, 5.0f);
  EXPECT_EQ(scene.world.solver.push_out_velocity, 2.0f);
  EXPECT_EQ(scene.world.solver.restitution_threshold, 0.5f);
  EXPECT_EQ(scene.world.solver.max_linear_speed, 200.0f);
  EXPECT_FALSE(scene.world.sleep.enabled);
  EXPECT_EQ(scene.world.sleep.linear_speed, 0.1f);
  EXPECT_EQ(scene.world.sleep.time, 1.0f);
  EXPECT_EQ(scene.world.threads, 3);
  EXPECT_EQ(scene.world.broad_phase, BroadPhase::sweep);
  EXPECT_TRUE(scene.world.sweep_axis == (Vec3{1, 0, 0}));
  ASSERT_TRUE(scene.kicks.has_value());
  EXPECT_EQ(scene.kicks->interval, 10);
  EXPECT_EQ(scene.kicks->linear, 0.25f);
  EXPECT_EQ(scene.kicks->angular, 0.125f);
  EXPECT_EQ(scene.kicks->seed, 7u);
}

TEST(SceneFile, WhatIsAbsentIsTheDefault) {
  const Scene scene = parse(body_with(""));
  const WorldDef world;
  const BodyDef body;
  EXPECT_EQ(scene.name, "scene");
  EXPECT_TRUE(scene.world.gravity == world.gravity);
  EXPECT_EQ(scene.world.dt, world.dt);
  EXPECT_EQ(scene.world.solver.method, world.solver.method);
  EXPECT_FALSE(scene.kicks.has_value());
  ASSERT_EQ(scene.bodies.size(), 1u);
  EXPECT_EQ(scene.bodies[0].motion, MotionType::dynamic);
  EXPECT_EQ(scene.bodies[0].density, body.density);
  EXPECT_FALSE(scene.bodies[0].mass.has_value());
  EXPECT_TRUE(scene.names.empty());
}

TEST(SceneFile, BodyWithEverything) {
  const Scene scene = parse(R"(
[materials.ice]
friction = 0.02
restitution = 0.1
friction_rule = "minimum"
restitution_rule = "average"
rolling_resistance = 0.03
surface_velocity = [1, 0, -2]
friction_axis = [0, 1, 0]
friction_along = 0.25
[shapes.crate]
type = "box"
half_extents = [0.5, 0.25, 1]
[[body]]
name = "first"
shape = "crate"
material = "ice"
motion = "kinematic"
position = [1, 2, 3]
rotation = [0, 0, 0, 2]
velocity = [4, 5, 6]
angular_velocity = [7, 8, 9]
gravity_scale = -1
linear_damping = 0.1
angular_damping = 0.2
can_sleep = false
sensor = true
filter = {category = 0x4, mask = 0xfffffff0}
user_data = 99
[[body]]
shape = "crate"
motion = "dynamic"
mass = 12.5
inertia = [1, 2, 3]
)");
  ASSERT_EQ(scene.bodies.size(), 2u);
  const BodyDef& body = scene.bodies[0];
  EXPECT_EQ(body.shape.type, ShapeType::box);
  EXPECT_TRUE(body.shape.half_extents == (Vec3{0.5f, 0.25f, 1}));
  EXPECT_EQ(body.material.friction, 0.02f);
  EXPECT_EQ(body.material.restitution, 0.1f);
  EXPECT_EQ(body.material.friction_rule, CombineRule::minimum);
  EXPECT_EQ(body.material.restitution_rule, CombineRule::average);
  EXPECT_EQ(body.material.rolling_resistance, 0.03f);
  EXPECT_TRUE(body.material.surface_velocity == (Vec3{1, 0, -2}));
  EXPECT_TRUE(body.material.friction_axis == (Vec3{0, 1, 0}));
  EXPECT_EQ(body.material.friction_along, 0.25f);
  EXPECT_EQ(body.motion, MotionType::kinematic);
  EXPECT_TRUE(body.pose.position == (Vec3{1, 2, 3}));
  EXPECT_EQ(body.pose.rotation.z, 1.0f);
  EXPECT_TRUE(body.velocity.linear == (Vec3{4, 5, 6}));
  EXPECT_TRUE(body.velocity.angular == (Vec3{7, 8, 9}));
  const BodyDef& heavy = scene.bodies[1];
  EXPECT_EQ(heavy.motion, MotionType::dynamic);
  EXPECT_EQ(heavy.mass, 12.5f);
  ASSERT_TRUE(heavy.inertia.has_value());
  EXPECT_EQ(heavy.inertia->yy, 2.0f);
  EXPECT_EQ(heavy.inertia->xy, 0.0f);
  EXPECT_EQ(body.gravity_scale, -1.0f);
  EXPECT_EQ(body.linear_damping, 0.1f);
  EXPECT_EQ(body.angular_damping, 0.2f);
  EXPECT_FALSE(body.can_sleep);
  EXPECT_TRUE(body.sensor);
  EXPECT_EQ(body.filter.category, 4u);
  EXPECT_EQ(body.filter.mask, 0xfffffff0u);
  EXPECT_EQ(body.user_data, 99u);
  ASSERT_EQ(scene.names.size(), 1u);
  EXPECT_EQ(scene.names[0].name, "first");
}

TEST(SceneFile, EveryShape) {
  const Scene scene = parse(R"(
[[body]]
shape = {type = "sphere", radius = 0.25}
[[body]]
shape = {type = "capsule", radius = 0.25, half_length = 1}
[[body]]
shape = {type = "box", half_extents = [1, 2, 3]}
[[body]]
shape = {type = "hull", points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]}
[[body]]
shape = {type = "cylinder", radius = 0.5, half_height = 2}
[[body]]
shape = {type = "cone", radius = 0.5, height = 1, top_radius = 0.1, sides = 12}
[[body]]
shape = {type = "box", half_extents = [1, 2, 3], rounding = 0.5}
[[body]]
shape = {type = "cylinder", radius = 0.5, half_height = 2, rounding = 0}
)");
  ASSERT_EQ(scene.bodies.size(), 8u);
  EXPECT_EQ(scene.bodies[0].shape.radius, 0.25f);
  EXPECT_EQ(scene.bodies[1].shape.half_extents.z, 1.0f);
  EXPECT_EQ(scene.bodies[2].shape.half_extents.z, 3.0f);
  ASSERT_TRUE(scene.bodies[3].shape.hull);
  EXPECT_EQ(scene.bodies[3].shape.hull->vertices().size(), 4u);
  EXPECT_EQ(scene.bodies[4].shape.hull->vertices().size(), 64u);
  EXPECT_EQ(scene.bodies[5].shape.hull->vertices().size(), 24u);
  EXPECT_EQ(scene.bodies[6].shape.hull->radius(), 0.5f);
  EXPECT_EQ(scene.bodies[7].shape.hull->radius(), 0);
  EXPECT_EQ(error_of("[[body]]\nshape = {type = \"box\", half_extents = [1, 1, 1], rounding = -1}\n"),
            "scene.toml:2:61: 'rounding' must not be negative");
  EXPECT_EQ(error_of("[[body]]\nshape = {type = \"cone\", radius = 1, height = 1, sides = 128}\n"),
            "scene.toml:2:57: 'sides' must be between 3 and 127, not 128");
}

TEST(SceneFile, RotationByAxisAndAngle) {
  const Scene scene = parse(body_with("rotation = {axis = [0, 2, 0], angle = 1.5707963}"));
  const Vec3 turned = rotate(scene.bodies[0].pose.rotation, {0, 0, 1});
  EXPECT_NEAR(turned.x, 1, 1e-6f);
  EXPECT_NEAR(turned.z, 0, 1e-6f);
}

TEST(SceneFile, RepeatFillsAGridFromTheFirstBody) {
  const Scene scene =
      parse(body_with("name = \"ball\"\nposition = [10, 0, 1]\n"
                      "repeat = {count = [2, 3, 2], spacing = [1.5, 2, 4]}"));
  ASSERT_EQ(scene.bodies.size(), 12u);
  EXPECT_TRUE(scene.bodies[0].pose.position == (Vec3{10, 0, 1}));
  EXPECT_TRUE(scene.bodies[1].pose.position == (Vec3{11.5f, 0, 1}));
  EXPECT_TRUE(scene.bodies[2].pose.position == (Vec3{10, 2, 1}));
  EXPECT_TRUE(scene.bodies[11].pose.position == (Vec3{11.5f, 4, 5}));
  ASSERT_EQ(scene.names.size(), 12u);
  EXPECT_EQ(scene.names[0].name, "ball.0");
  EXPECT_EQ(scene.names[11].name, "ball.11");
  EXPECT_EQ(scene.names[11].body, 11u);
}

// Mistakes ------------------------------------------------------------------------------------------------------

struct Mistake {
  std::string text;
  std::string error;
};

TEST(SceneFile, WrongKeysAreNamedWithTheNearestRightOne) {
  const Mistake mistakes[] = {
      {body_with("mas = 1"), "scene.toml:3:1: unknown key 'mas' in [[body]]; did you mean 'mass'?"},
      {body_with("") + "[wrold]\n", "scene.toml:4:2: unknown key 'wrold' in a scene; did you mean 'world'?"},
      {"[world]\ngravitation = [0, 0, 0]\n" + body_with(""),
       "scene.toml:2:1: unknown key 'gravitation' in [world]; did you mean 'gravity'?"},
      // A word too many is nearer than another word of the same length.
      {body_with("linear_velocity = [1, 0, 0]"),
       "scene.toml:3:1: unknown key 'linear_velocity' in [[body]]; did you mean 'velocity'?"},
      {body_with("damping = 1"), "scene.toml:3:1: unknown key 'damping' in [[body]]; did you mean 'linear_damping'?"},
      {body_with("MASS = 1"), "scene.toml:3:1: unknown key 'MASS' in [[body]]; did you mean 'mass'?"},
      {body_with("weight = 1"), "scene.toml:3:1: unknown key 'weight' in [[body]]; known: name, motion, "},
      {"[materials.ice]\nzzzzzz = 1\n" + body_with(""),
       "scene.toml:2:1: unknown key 'zzzzzz' in [materials.ice]; known: friction, restitution, friction_rule, "
       "restitution_rule, rolling_resistance, surface_velocity, friction_axis, friction_along"},
      {"[shapes.ball]\ntype = \"sphere\"\nradius = 1\nhalf_length = 2\n" + body_with(""),
       "scene.toml:4:1: unknown key 'half_length' in [shapes.ball]; known: type, radius"},
      // The first in the file, not the first in alphabetical order.
      {body_with("zz_one = 1\naa_two = 2"), "scene.toml:3:1: unknown key 'zz_one'"},
  };
  for (const Mistake& mistake : mistakes) EXPECT_THAT(error_of(mistake.text), testing::StartsWith(mistake.error));
}

TEST(SceneFile, WrongTypes) {
  const Mistake mistakes[] = {
      {body_with("mass = \"heavy\""), "scene.toml:3:8: 'mass' must be a number, not a string"},
      {body_with("mass = true"), "scene.toml:3:8: 'mass' must be a number, not a boolean"},
      {body_with("position = 3"), "scene.toml:3:12: 'position' must be an array, not an integer"},
      {body_with("position = [1, 2]"), "scene.toml:3:12: 'position' must have 3 numbers, not 2"},
      {body_with("position = [1, 2, \"x\"]"), "scene.toml:3:19: 'position' must be a number, not a string"},
      {body_with("rotation = [1, 0, 0]"), "scene.toml:3:12: 'rotation' must have 4 numbers, not 3"},
      {body_with("can_sleep = 1"), "scene.toml:3:13: 'can_sleep' must be true or false, not an integer"},
      {body_with("name = 5"), "scene.toml:3:8: 'name' must be a string, not an integer"},
      {body_with("filter = 3"), "scene.toml:3:10: 'filter' must be a table, not an integer"},
      {"[solver]\nsubsteps = 2.5\n" + body_with(""), "scene.toml:2:12: 'substeps' must be an integer, not a number"},
      {"world = 1\n" + body_with(""), "scene.toml:1:9: 'world' must be a table, not an integer"},
      {"[body]\nshape = \"x\"\n", "scene.toml:1:1: write [[body]] with two brackets: there may be several"},
      {"body = [1]\n", "scene.toml:1:9: 'body' must be a table, not an integer"},
  };
  for (const Mistake& mistake : mistakes) EXPECT_EQ(error_of(mistake.text), mistake.error);
}

TEST(SceneFile, NumbersOutOfRange) {
  const Mistake mistakes[] = {
      {body_with("mass = -1"), "scene.toml:3:8: 'mass' must be greater than 0"},
      {body_with("mass = 0"), "scene.toml:3:8: 'mass' must be greater than 0"},
      {body_with("mass = inf"), "scene.toml:3:8: 'mass' must be finite"},
      {body_with("mass = 1e300"), "scene.toml:3:8: 'mass' must be finite"},
      {body_with("density = nan"), "scene.toml:3:11: 'density' must be finite"},
      {body_with("position = [0, nan, 0]"), "scene.toml:3:16: 'position' must be finite"},
      {body_with("linear_damping = -0.5"), "scene.toml:3:18: 'linear_damping' must not be negative"},
      {body_with("rotation = [0, 0, 0, 0]"),
       "scene.toml:3:12: 'rotation' is all 0; write [1, 0, 0, 0] for a body that is not turned"},
      {body_with("rotation = {axis = [0, 0, 0], angle = 1}"),
       "scene.toml:3:20: 'axis' has no length; it points along the axis of rotation"},
      {body_with("inertia = [1, 1, -1]"),
       "scene.toml:3:11: 'inertia' must be positive definite; the diagonal must outweigh the products"},
      {body_with("inertia = [1, 1, 1, 1]"),
       "scene.toml:3:11: 'inertia' must be [xx, yy, zz] or [xx, yy, zz, xy, xz, yz] (kg·m²)"},
      {body_with("filter = {category = 1.5}"), "scene.toml:3:22: 'category' must be an integer, not a number"},
      {body_with("filter = {group = 3000000000}"),
       "scene.toml:3:19: 'group' must be between -2147483648 and 2147483647, not 3000000000"},
      {body_with("repeat = {count = [0, 1, 1], spacing = [1, 1, 1]}"),
       "scene.toml:3:19: every component of 'count' must be a whole number from 1"},
      {body_with("repeat = {count = [1000, 1000, 1000], spacing = [1, 1, 1]}"),
       "scene.toml:1:1: the world holds at most 16777216 bodies; repeat fewer"},
      {"[world]\ndt = 0\n" + body_with(""),
       "scene.toml:2:6: 'dt' must be between 1e-6 and 1 s, not 0; typically 1/60: 0.0166667"},
      {"[world]\ndt = -1\n" + body_with(""),
       "scene.toml:2:6: 'dt' must be between 1e-6 and 1 s, not -1; typically 1/60: 0.0166667"},
      {"[world]\ndt = nan\n" + body_with(""),
       "scene.toml:2:6: 'dt' must be between 1e-6 and 1 s, not nan; typically 1/60: 0.0166667"},
      {"[world]\ndt = 'fast'\n" + body_with(""), "scene.toml:2:6: 'dt' must be a number, not a string"},
      {"[world]\nmax_bodies = 0\n" + body_with(""),
       "scene.toml:2:14: 'max_bodies' must be between 1 and 16777216, not 0"},
      {"[world]\nmax_bodies = -1\n" + body_with(""),
       "scene.toml:2:14: 'max_bodies' must be between 1 and 16777216, not -1"},
      {"[solver]\nsubsteps = 0\n" + body_with(""), "scene.toml:2:12: 'substeps' must be between 1 and 1000, not 0"},
      {"[simulator]\nsweep_axis = [0, 0, 0]\n" + body_with(""),
       "scene.toml:2:14: 'sweep_axis' has no length; one component must be greater than 0"},
      {"[simulator]\nsweep_axis = [1, -1, 0]\n" + body_with(""),
       "scene.toml:2:14: every component of 'sweep_axis' must not be negative"},
      {"[materials.m]\nrestitution = 1.5\n" + body_with(""), "scene.toml:2:15: 'restitution' must be between 0 and 1"},
      {"[shapes.s]\ntype = \"sphere\"\nradius = -1\n" + body_with(""),
       "scene.toml:3:10: 'radius' must be greater than 0"},
  };
  for (const Mistake& mistake : mistakes) EXPECT_EQ(error_of(mistake.text), mistake.error);
}

// Values that a world would reject, or that would have no effect, are rejected with their location in the file.
TEST(SceneFile, WhatAWorldRefusesHasItsPlace) {
  const Mistake mistakes[] = {
      {body_with("inertia = [1, 1, 10]"),
       "scene.toml:3:11: the inertia's principal moments are (1, 1, 10) kg·m²; none may be larger than the sum of the "
       "other two"},
      {"[[body]]\nshape = {type = \"box\", half_extents = [1e-30, 1, 1]}\n",
       "scene.toml:2:9: shape: fathom::box: the smallest half extent is 1e-30 m; it must be at least a millionth of "
       "the "
       "largest length"},
      {"[[body]]\nshape = {type = \"capsule\", radius = 1e-7, half_length = 1}\n",
       "scene.toml:2:9: shape: fathom::capsule: the radius is 1e-07 m; it must be at least a millionth of the largest "
       "length"},
      {body_with("motion = \"static\"\nvelocity = [1, 0, 0]"),
       "scene.toml:4:12: a static body has no 'velocity'; remove it, or write motion = \"kinematic\""},
      {body_with("motion = \"fixed\"\nangular_velocity = [0, 0, 1]"),
       "scene.toml:4:20: a static body has no 'angular_velocity'; remove it, or write motion = \"kinematic\""},
      {body_with("motion = \"static\"\nmass = 3"),
       "scene.toml:4:8: a static body has no 'mass'; remove it, or write motion = \"dynamic\""},
      {body_with("density = 3\nmotion = \"fixed\""),
       "scene.toml:3:11: a static body has no 'density'; remove it, or write motion = \"dynamic\""},
      {body_with("motion = \"kinematic\"\ninertia = [1, 1, 1]"),
       "scene.toml:4:11: a kinematic body has no 'inertia'; remove it, or write motion = \"dynamic\""},
      {body_with("motion = \"static\"\nbullet = true"),
       "scene.toml:4:10: a static body cannot be a 'bullet'; remove it, or write motion = \"dynamic\""},
      {body_with("bullet = true\nmotion = \"kinematic\""),
       "scene.toml:3:10: a kinematic body cannot be a 'bullet'; remove it, or write motion = \"dynamic\""},
      {"[world]\ndt = 10\n" + body_with(""),
       "scene.toml:2:6: 'dt' must be between 1e-6 and 1 s, not 10; typically 1/60: 0.0166667"},
      {"[world]\ndt = 1e-9\n" + body_with(""),
       "scene.toml:2:6: 'dt' must be between 1e-6 and 1 s, not 1e-09; typically 1/60: 0.0166667"},
      {"[simulator]\ndevice = \"host\"\nkind = \"native\"\n" + body_with(""),
       "scene.toml:2:10: 'device' applies to the simulators device and hybrid only; remove it or kind = \"native\""},
      {"[solver]\niterations = 1001\n" + body_with(""),
       "scene.toml:2:14: 'iterations' must be between 1 and 1000, not 1001"},
      {"[solver]\nmarking_rounds = 999\n" + body_with(""),
       "scene.toml:2:18: 'marking_rounds' must be between 1 and 255, not 999"},
      {"[simulator]\nahead = 17\n" + body_with(""), "scene.toml:2:9: 'ahead' must be between 0 and 16, not 17"},
      {"[simulator]\nthreads = 5000\n" + body_with(""),
       "scene.toml:2:11: 'threads' must be between 0 and 1024, not 5000"},
  };
  for (const Mistake& mistake : mistakes) EXPECT_EQ(error_of(mistake.text), mistake.error);
  EXPECT_FALSE(parse(body_with("motion = \"fixed\"\nbullet = false")).bodies[0].bullet);
  EXPECT_TRUE(parse(body_with("bullet = true")).bodies[0].bullet);
  // A fixed body may state a velocity of zero.
  EXPECT_EQ(parse_scene(body_with("motion = \"fixed\"\nvelocity = [0, 0, 0]"), "scene.toml").bodies[0].motion,
            MotionType::fixed);
}

TEST(SceneFile, ShapesThatThereAreNoneOfNameWhatToTake) {
  for (const char* type : {"trimesh", "heightfield", "terrain", "plane"})
    EXPECT_THAT(error_of("[[body]]\nshape = {type = \"" + std::string(type) + "\", file = \"x.obj\"}\n"),
                testing::StartsWith("scene.toml:2:17: there is no shape of type '" + std::string(type) + "'; take "));
}

TEST(SceneFile, WrongChoicesReferencesAndOmissions) {
  const Mistake mistakes[] = {
      {body_with("motion = \"dinamic\""), "scene.toml:3:10: 'dinamic' is not a valid motion; did you mean 'dynamic'?"},
      {"[simulator]\nkind = \"gpu\"\n" + body_with(""),
       "scene.toml:2:8: 'gpu' is not a valid kind; known: native, device, hybrid"},
      {"[simulator]\nbroad_phase = \"seep\"\n" + body_with(""),
       "scene.toml:2:15: 'seep' is not a valid broad_phase; did you mean 'sweep'?"},
      {"[materials.ice]\n" + body_with("material = \"icy\""),
       "scene.toml:4:12: there is no [materials.icy]; did you mean 'ice'?"},
      {body_with("material = \"ice\""),
       "scene.toml:3:12: there is no [materials.ice]; write one, or the material itself as a table"},
      {"[[body]]\nshape = \"crate\"\n",
       "scene.toml:2:9: there is no [shapes.crate]; write one, or the shape itself as a table"},
      {"[[body]]\nmass = 1\n", "scene.toml:1:1: [[body]] needs 'shape': the name of one of [shapes], or a table"},
      {"[[body]]\nshape = {radius = 1}\n",
       "scene.toml:2:9: shape needs 'type': write type = \"sphere\", \"capsule\", \"box\", \"hull\", \"cylinder\", "
       "\"cone\", \"compound\", "
       "\"mesh\" or \"height_field\""},
      {"[[body]]\nshape = {type = \"box\"}\n",
       "scene.toml:2:9: shape needs 'half_extents': half its edges along x, y and z (m)"},
      {body_with("mass = 1\ndensity = 2"), "scene.toml:4:11: a body has either 'mass' or 'density'; remove one"},
      {body_with("name = \"a\"") + body_with("name = \"a\""),
       "scene.toml:6:8: another body is named 'a'; names are unique"},
      {body_with("repeat = {count = [2, 2, 2]}"),
       "scene.toml:3:10: repeat needs 'spacing': write repeat = {count = [4, 4, 1], spacing = [1.1, 1.1, 1.1]}"},
      {"", "scene.toml:1:1: a scene needs 'body': write at least one [[body]]"},
  };
  for (const Mistake& mistake : mistakes) EXPECT_EQ(error_of(mistake.text), mistake.error);
}

TEST(SceneFile, HullWithoutVolume) {
  EXPECT_THAT(error_of("[shapes.flat]\ntype = \"hull\"\n"
                       "points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]\n" +
                       body_with("")),
              testing::StartsWith("scene.toml:1:1: [shapes.flat]: "));
}

TEST(SceneFile, BrokenToml) {
  const std::string value = " is not a value; write a number, true, false, or a text in straight quotation marks";
  const std::string number = " is not a number; write numbers like 3, 0.5 or 1e-3";
  const std::string line = "; write one key = value per line, texts in quotation marks, lists like [1, 2]";
  const Mistake mistakes[] = {
      {"name = \"a\n",
       "scene.toml:1:10: a text is not closed on its line; end it with the quotation mark that it begins with"},
      {"name = 'a\r\n",
       "scene.toml:1:10: a text is not closed on its line; end it with the quotation mark that it begins with"},
      {"name = \"\"\"a\n",
       "scene.toml:1:13: a text is not closed before the end of the file; end it with the quotation marks that it "
       "begins with"},
      {"[world]\ndt 0.01\n", "scene.toml:2:4: there is no '=' after the key; write key = value"},
      {"dt = = 3\n", "scene.toml:1:6: there is one '=' too many; write key = value"},
      {"[world]\ndt =\n", "scene.toml:2:5: there is no value after '='; write key = value"},
      {"= 3\n", "scene.toml:1:1: there is no key before '='; write key = value"},
      {"[world]\ndt = 0.1\n  dt = 0.2\n", "scene.toml:3:3: 'dt' is set twice; remove one of them"},
      {"[world]\ndt = 0.1\n[world]\n", "scene.toml:3:1: [world] is there twice; put all its keys into one"},
      {"[[body]]\n[body]\n", "scene.toml:2:1: 'body' is a list above; write [[body]] for one more table of it"},
      {"[body]\n[[body]]\n", "scene.toml:2:1: 'body' is set above, but not as [[body]]; write [[body]] each time"},
      {"x = 1.2.3\n", "scene.toml:1:5: '1.2.3'" + number},
      {"x = [0, .5]\n", "scene.toml:1:9: '.5'" + number},
      {"x = 1/60\n", "scene.toml:1:5: '1/60'" + number},
      {"x = 01\n", "scene.toml:1:5: '01' begins with 0; leave that out"},
      {"x = 99999999999999999999\n",
       "scene.toml:1:5: '99999999999999999999' is too large; a whole number has 64 bits at most"},
      {"x = 1e999\n", "scene.toml:1:5: '1e999' is too large or too small; numbers have sizes from 1e-307 to 1e308"},
      {"x = 1,5\n", "scene.toml:1:6: ',' follows the value" + line},
      {"x = 10 m\n", "scene.toml:1:8: 'm' follows the value" + line},
      {"x = yes\n", "scene.toml:1:5: 'yes'" + value},
      {"x = True\n", "scene.toml:1:5: 'True'" + value},
      {"x = tru\n", "scene.toml:1:5: 'tru'" + value},
      {"x = null\n", "scene.toml:1:5: 'null'" + value},
      {"x = “é”\n", "scene.toml:1:5: '“é”'" + value},
      {"x = [1 2]\n", "scene.toml:1:8: a comma or the closing ] is missing before '2'; write lists like [1, 2, 3]"},
      {"x = [1, 2\n", "scene.toml:1:11: a list is not closed before the end of the file; end it with ]"},
      {"x = {a = 1,\nb = 2}\n",
       "scene.toml:1:12: a table in { } is on one line; join its lines, or write it below as [name]"},
      {"x = {a = 1 b = 2}\n",
       "scene.toml:1:12: a comma or the closing } is missing before 'b'; write tables like {a = 1, b = 2}"},
      {"[world\n", "scene.toml:1:7: the name of a table is not closed; write [name] or [[name]]"},
      {"[a]]\n", "scene.toml:1:4: there is one ] too many; write [name] or [[name]]"},
      {"[a.]\n", "scene.toml:1:4: there is no name before ']'; write key = value or [name]"},
      {"x = 'a\x01'\n", "scene.toml:1:7: there is a control character here; remove it, or give a text file"},
      {std::string("\0x", 2), "scene.toml:1:1: there is a control character here; remove it, or give a text file"},
      {"x = \"\xff\"\n", "scene.toml:1:5: this is not UTF-8; save the file as UTF-8"},
      {"x = \"C:\\data\"\n",
       "scene.toml:1:9: \\d has no meaning in a text; write \\\\ for a backslash, or put the text in single quotation "
       "marks"},
      {"{\"a\": 1}\n", "scene.toml:1:1: '{' cannot begin a line; write key = value, [table] or # and a comment"},
      // What has no words of ours keeps those of toml++, on one line.
      {"x = 2026-13-01\n",
       "scene.toml:1:12: this is not TOML: date: expected month between 1 and 12 (inclusive), saw 13"},
  };
  for (const Mistake& mistake : mistakes) EXPECT_EQ(error_of(mistake.text), mistake.error);
  EXPECT_THAT(error_of(std::string(100000, '[')), testing::StartsWith("scene.toml:1:"));
  EXPECT_THAT(error_of("x = " + std::string(100000, '[')),
              testing::HasSubstr("brackets are nested too deeply; remove some"));
}

TEST(SceneFile, MissingFileAndFolder) {
  const auto error_of_path = [](const std::string& path) {
    try {
      load_scene(path);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::file);
      return std::string(error.what());
    }
    return std::string("(no error)");
  };
  EXPECT_EQ(error_of_path("nowhere.toml"), "nowhere.toml: no such file; give the path of a scene (*.toml)");
  const std::string folder = testing::TempDir();
  EXPECT_EQ(error_of_path(folder), folder + ": is a folder; give the path of a scene (*.toml)");
}

// The examples --------------------------------------------------------------------------------------------------

TEST(SceneExamples, EachLoadsAndRuns) {
  int examples = 0;
  for (const auto& entry : std::filesystem::directory_iterator(FATHOM_SOURCE_DIR "/examples/scenes")) {
    if (entry.path().extension() != ".toml") continue;
    SCOPED_TRACE(entry.path().filename());
    ++examples;
    Scene scene = load_scene(entry.path().string());
    scene.world.threads = 1;
    World world(scene.world);
    SceneInstance instance(scene, world);
    std::size_t broken = 0;
    for (int step = 0; step < 10; ++step) {
      instance.prepare_step();
      world.step();
      broken += world.joints_broken().size();
    }
    EXPECT_EQ(world.body_count(), scene.bodies.size());
    EXPECT_EQ(world.joint_count() + broken, scene.joints.size());
    EXPECT_TRUE(world.quarantined().empty());
  }
  EXPECT_GE(examples, 8);
}

TEST(SceneExamples, TheDocumentMentionsEveryKey) {
  std::ifstream file(FATHOM_SOURCE_DIR "/docs/scenes.md");
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  for (const char* key : {"name",
                          "gravity",
                          "dt",
                          "max_bodies",
                          "ground_height",
                          "method",
                          "substeps",
                          "iterations",
                          "contact_hertz",
                          "contact_damping_ratio",
                          "enabled",
                          "linear_speed",
                          "time",
                          "push_out_velocity",
                          "restitution_threshold",
                          "kind",
                          "threads",
                          "broad_phase",
                          "sweep_axis",
                          "preset",
                          "device",
                          "ahead",
                          "partition",
                          "warm_start",
                          "direct_joints",
                          "marking_rounds",
                          "max_linear_speed",
                          "interval",
                          "linear",
                          "angular",
                          "seed",
                          "friction",
                          "restitution",
                          "friction_rule",
                          "type",
                          "restitution_rule",
                          "rolling_resistance",
                          "surface_velocity",
                          "friction_axis",
                          "friction_along",
                          "radius",
                          "half_length",
                          "half_extents",
                          "points",
                          "file",
                          "scale",
                          "offset",
                          "vertices",
                          "triangles",
                          "columns",
                          "rows",
                          "cell",
                          "heights",
                          "holes",
                          "materials",
                          "triangle_materials",
                          "cell_materials",
                          "waves",
                          "hills",
                          "roughness",
                          "motion",
                          "shape",
                          "material",
                          "position",
                          "rotation",
                          "velocity",
                          "angular_velocity",
                          "mass",
                          "density",
                          "inertia",
                          "gravity_scale",
                          "linear_damping",
                          "can_sleep",
                          "sensor",
                          "bullet",
                          "pre_solve",
                          "custom_filter",
                          "angular_damping",
                          "filter",
                          "category",
                          "mask",
                          "group",
                          "user_data",
                          "repeat",
                          "count",
                          "spacing",
                          "axis",
                          "angle",
                          "a",
                          "b",
                          "point",
                          "anchor_a",
                          "anchor_b",
                          "hertz",
                          "damping_ratio",
                          "collide_connected",
                          "frame_a",
                          "frame_b",
                          "x",
                          "twist",
                          "swing_y",
                          "cone_angle",
                          "suspension",
                          "steering",
                          "motor",
                          "mode",
                          "lower",
                          "upper",
                          "length",
                          "drive",
                          "stiffness",
                          "damping",
                          "max_force"}) {
    EXPECT_NE(text.find("`" + std::string(key) + "`"), std::string::npos) << key;
  }
}

}  // namespace
}  // namespace fathom::scene_test
