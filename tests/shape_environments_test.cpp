// The environments with other shapes than ordered cubes: small versions, on both simulators.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/compound.hpp>
#include <fathom/mesh.hpp>
#include <string>
#include <vector>

#include "scene/environments.hpp"
#include "scene/overlaps.hpp"
#include "scene/quality.hpp"

namespace fathom::shape_environments_test {
namespace {

struct Small {
  const char* name;
  std::int64_t bodies;
  int steps;
};
constexpr Small small_ones[] = {{"large_pyramid", 55, 120}, {"many_pyramids", 110, 120}, {"wide_pyramid", 55, 240},
                                {"washer", 216, 300},       {"convex_pile", 128, 240},   {"junkyard", 441, 300},
                                {"joint_grid", 90, 120},    {"chains", 105, 240},        {"rocks", 120, 240},
                                {"ragdolls", 90, 300},      {"spheres", 120, 240},       {"capsules", 120, 240},
                                {"mixed", 120, 240}};

struct End {
  Quality quality;
  std::uint64_t hash;
};

End simulate(const Small& what, SimulatorKind simulator, int threads) {
  Scene scene = find_environment(what.name)->make(what.bodies);
  scene.world.simulator = simulator;
  scene.world.device = "host";
  scene.world.threads = threads;
  World world(scene.world);
  SceneInstance instance(scene, world);
  for (int i = 0; i < what.steps; ++i) {
    instance.prepare_step();
    world.step();
  }
  world.wait();
  return {measure_quality(scene, instance, world), world.state_hash()};
}

class ShapeEnvironments : public testing::TestWithParam<Small> {};

TEST_P(ShapeEnvironments, HaveTheBodiesThatAreAskedFor) {
  const Scene scene = find_environment(GetParam().name)->make(GetParam().bodies);
  EXPECT_EQ(dynamic_body_count(scene), static_cast<std::size_t>(GetParam().bodies));
  EXPECT_EQ(scene.name, GetParam().name);
  EXPECT_FALSE(scene.world.sleep.enabled);
  // No body starts inside another. (In the yard, as in Box3D's, the first rocks hang over the column, down to its top.)
  if (scene.name == "junkyard") return;
  std::vector<Pose> poses;
  for (const BodyDef& body : scene.bodies) poses.push_back(body.pose);
  EXPECT_LE(deepest_overlap(scene, poses), 1e-4);
}

TEST_P(ShapeEnvironments, LoseNobody) {
  const bool scene_is_thrown_about = std::string(GetParam().name) == "washer";
  for (const SimulatorKind simulator : {SimulatorKind::native, SimulatorKind::device}) {
    const Quality q = simulate(GetParam(), simulator, 1).quality;
    EXPECT_EQ(q.escaped, 0u);
    EXPECT_EQ(q.bodies_below_ground, 0u);
    EXPECT_EQ(q.non_finite, 0u);
    // Bodies thrown about at 7 m/s by the blades of a drum overlap deeply for a moment; `BladesOfADrum…` looks at many.
    if (!scene_is_thrown_about) {
      EXPECT_LE(q.overlap_max, 0.1);
    }
  }
}

TEST_P(ShapeEnvironments, DoNotDependOnThreads) {
  for (const SimulatorKind simulator : {SimulatorKind::native, SimulatorKind::device})
    EXPECT_EQ(simulate(GetParam(), simulator, 1).hash, simulate(GetParam(), simulator, 2).hash);
}

INSTANTIATE_TEST_SUITE_P(Small, ShapeEnvironments, testing::ValuesIn(small_ones),
                         [](const auto& small) { return std::string(small.param.name); });

TEST(ShapeEnvironment, DefaultsAreThoseOfBox3D) {
  const auto dynamic_ones = [](const char* name) {
    const Environment& environment = *find_environment(name);
    return dynamic_body_count(environment.make(environment.default_bodies));
  };
  EXPECT_EQ(dynamic_ones("large_pyramid"), 5050u);
  EXPECT_EQ(dynamic_ones("many_pyramids"), 10780u);
  EXPECT_EQ(dynamic_ones("wide_pyramid"), 1240u);
  EXPECT_EQ(dynamic_ones("washer"), 8000u);
  EXPECT_EQ(dynamic_ones("convex_pile"), 5120u);
  EXPECT_EQ(dynamic_ones("junkyard"), 10584u);
  EXPECT_EQ(dynamic_ones("joint_grid"), 9900u);
  EXPECT_EQ(dynamic_ones("ragdolls"), 4200u);
  EXPECT_EQ(find_environment("rain")->make(4200).joints.size(), 300u * 13);
  const Scene grid = find_environment("joint_grid")->make(9900);
  EXPECT_EQ(grid.bodies.size(), 10000u);
  EXPECT_EQ(grid.joints.size(), 19800u - 99) << "without those between fixed ones";
}

/// The environments with surfaces or compounds.
constexpr Small in_parts[] = {
    {"trees100", 50, 300}, {"trees50", 20, 200}, {"terrain", 300, 400}, {"tetrapods", 120, 240}};

TEST(ShapeEnvironment, LandscapesAndCompoundsLoseNobody) {
  for (const Small& small : in_parts) {
    SCOPED_TRACE(small.name);
    const Scene scene = find_environment(small.name)->make(small.bodies);
    EXPECT_EQ(dynamic_body_count(scene), static_cast<std::size_t>(small.bodies));
    std::vector<Pose> poses;
    for (const BodyDef& body : scene.bodies) poses.push_back(body.pose);
    EXPECT_LE(deepest_overlap(scene, poses), 1e-4);
    for (const SimulatorKind simulator : {SimulatorKind::native, SimulatorKind::device}) {
      const End end = simulate(small, simulator, 1);
      EXPECT_EQ(end.quality.non_finite, 0u);
      EXPECT_EQ(end.quality.bodies_below_ground, 0u);
      EXPECT_EQ(end.quality.escaped, 0u);
      EXPECT_LE(end.quality.overlap_max, 0.1);
      EXPECT_EQ(end.hash, simulate(small, simulator, 2).hash);
    }
  }
}

TEST(ShapeEnvironment, TreesAreAsLongAsBox3DsAndTheirMeshesAsFine) {
  const Scene scene = find_environment("trees25")->make(50);
  EXPECT_EQ(scene.bodies[0].shape.surface->triangle_count(), 960'000u);
  ASSERT_EQ(scene.bodies.size(), 51u);
  const Compound& tree = *scene.bodies[1].shape.compound;
  EXPECT_EQ(tree.children().size(), 22u);
  // Parts of 1.5 m with room for balls of 0.75 m · 0.95ⁿ below and above; each starts where the last one's room ends.
  const double room = 1.5 * (1 - std::pow(0.95, 22)) / 0.05, ends = 0.75 - 0.75 * std::pow(0.95, 21);
  EXPECT_NEAR(tree.bounds().upper.z - tree.bounds().lower.z, 22 * 1.5 + room + ends, 0.01);
}

TEST(ShapeEnvironment, ALargeWorldCarriesItsBalls) {
  for (const std::int64_t boxes : {1, 10'000}) {
    const Small world{"large_world", boxes, 120};
    EXPECT_EQ(dynamic_body_count(find_environment("large_world")->make(boxes)), 100u);
    for (const SimulatorKind simulator : {SimulatorKind::native, SimulatorKind::device}) {
      const Quality q = simulate(world, simulator, 1).quality;
      EXPECT_EQ(q.bodies_below_ground, 0u);
      EXPECT_LE(q.overlap_max, 0.01);
      EXPECT_LE(q.kinetic_energy_per_body, 0.5);
    }
  }
}

// Blades at 7 m/s must not run over the cubes they carry when these hit the wall within a step.
TEST(ShapeEnvironment, BladesOfADrumDoNotRunOverWhatTheyCarry) {
  for (const SimulatorKind simulator : {SimulatorKind::native, SimulatorKind::device}) {
    Scene scene = find_environment("washer")->make(216);
    scene.world.simulator = simulator;
    scene.world.device = "host";
    scene.world.threads = 1;
    World world(scene.world);
    SceneInstance instance(scene, world);
    std::vector<double> overlaps;
    for (int i = 1; i <= 600; ++i) {
      instance.prepare_step();
      world.step();
      if (i > 200 && i % 20 == 0) overlaps.push_back(measure_quality(scene, instance, world).overlap_max);
    }
    std::ranges::nth_element(overlaps, overlaps.begin() + 10);
    EXPECT_LE(overlaps[10], 0.03);
  }
}

// The widest gaps of a net that hangs still and of chains that swing.
TEST(ShapeEnvironment, JointsHold) {
  EXPECT_LE(simulate({"joint_grid", 90, 120}, SimulatorKind::native, 1).quality.joint_gap_max, 2e-3);
  EXPECT_LE(simulate({"joint_grid", 90, 120}, SimulatorKind::device, 1).quality.joint_gap_max, 2e-3);
  EXPECT_LE(simulate({"chains", 105, 240}, SimulatorKind::native, 1).quality.joint_gap_max, 1e-4);
}

// Ragdolls that hit the ground at 20 m/s, once they lie. A body of 90 kg behind a head must not spin its neck at the
// limit of 3,840 rad/s, which would part it by kilometres.
TEST(ShapeEnvironment, RagdollsStayTogether) {
  for (const SimulatorKind simulator : {SimulatorKind::native, SimulatorKind::device}) {
    const Quality q = simulate({"ragdolls", 84, 400}, simulator, 1).quality;
    EXPECT_LE(q.joint_gap_max, 0.02);
    EXPECT_LE(q.kinetic_energy_per_body, 0.5);
    EXPECT_LE(q.displacement_max, 40);
  }
}

TEST(ShapeEnvironment, RagdollsLieOnMeshes) {
  const Small rained{"rain", 420, 300};
  const Scene scene = find_environment(rained.name)->make(rained.bodies);
  EXPECT_EQ(dynamic_body_count(scene), 420u);
  EXPECT_EQ(scene.joints.size(), 390u);
  const End end = simulate(rained, SimulatorKind::native, 1);
  EXPECT_EQ(end.quality.non_finite, 0u);
  EXPECT_EQ(end.quality.bodies_below_ground, 0u);
  EXPECT_LE(end.quality.joint_gap_max, 0.02);
  EXPECT_EQ(end.hash, simulate(rained, SimulatorKind::native, 2).hash);
}

// A drum's parts and the pusher are where the rotation of the whole takes them, whatever the number of steps.
TEST(ShapeEnvironment, WhatGoesRoundIsWhereTheTurnTakesIt) {
  for (const char* name : {"washer", "junkyard"}) {
    Scene scene = find_environment(name)->make(1);
    World world(scene.world);
    SceneInstance instance(scene, world);
    for (int step = 0; step < 500; ++step) {
      instance.prepare_step();
      world.step();
    }
    const Orbit& orbit = *scene.orbit;
    const double angle = 6.283185307179586 * orbit.speed * 500 * static_cast<double>(scene.world.dt);
    for (std::size_t i = orbit.first; i < orbit.first + orbit.count; ++i) {
      const Vec3 from = scene.bodies[i].pose.position - orbit.centre, along = dot(orbit.axis, from) * orbit.axis;
      const Vec3 out = from - along, aside = cross(orbit.axis, from);
      const Vec3 expected = orbit.centre + along + static_cast<float>(std::cos(angle)) * out +
                            static_cast<float>(std::sin(angle)) * aside;
      EXPECT_LT(distance(world.pose(instance.ids()[i]).position, expected), 1e-4f) << name << " " << i;
      const Vec3 turning = world.velocity(instance.ids()[i]).angular;
      EXPECT_TRUE(is_finite(turning));
    }
  }
}

// Two balls of 1 m, 0.9 m apart, and one that only touches the floor.
TEST(Overlaps, TheDeepestIsFoundWhateverTheSizes) {
  BodyDef floor;
  floor.motion = MotionType::fixed;
  floor.shape = box({100, 100, 1});
  floor.pose.position = {0, 0, -1};
  BodyDef ball;
  ball.shape = sphere(0.5f);
  ball.pose.position = {-7.3f, 2, 0.5f};
  Scene scene;
  scene.bodies = {floor, ball, ball, ball};
  std::vector<BodyDef>& bodies = scene.bodies;
  bodies[2].pose.position.x += 0.9f;
  bodies[3].pose.position.x += 40;
  const auto deepest = [&] {
    std::vector<Pose> poses;
    for (const BodyDef& body : bodies) poses.push_back(body.pose);
    return deepest_overlap(scene, poses);
  };
  EXPECT_NEAR(deepest(), 0.1, 1e-4);
  bodies[3].pose.position.z -= 0.25f;
  EXPECT_NEAR(deepest(), 0.25, 1e-4);
  bodies[3].pose.position.z = std::nanf("");
  EXPECT_NEAR(deepest(), 0.1, 1e-4);
  // Bodies that may not touch do not count.
  scene.joints = {{2, 1, {}}};
  EXPECT_EQ(deepest(), 0);
  scene.joints[0].def.collide_connected = true;
  EXPECT_NEAR(deepest(), 0.1, 1e-4);
  bodies[1].filter.category = 2;
  bodies[2].filter.mask = ~2u;
  EXPECT_EQ(deepest(), 0);
}

}  // namespace
}  // namespace fathom::shape_environments_test
