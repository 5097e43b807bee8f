// Surfaces that move relative to their bodies: conveyor belts, tracks, and what lies on them.
#include <gtest/gtest.h>

#include <cmath>
#include <fathom/compound.hpp>
#include <limits>
#include <string>
#include <vector>

#include "test_surfaces.hpp"
#include "world_variants.hpp"

namespace fathom::test::belt_test {
namespace {

constexpr float dt = 1.0f / 60, g = 9.81f, mu = 0.5f;

class Belts : public testing::TestWithParam<Variant> {
 protected:
  static WorldDef sleepy(int threads = 1) { return sleepy_world(GetParam(), threads); }
  static WorldDef quiet(int threads = 1) { return quiet_world(GetParam(), threads); }
  /// With the solver `impulse`, bodies on several contacts slip a little, on moving platforms no less.
  static bool is_exact() { return GetParam().solver == Solver::soft; }
  static bool is_device() { return GetParam().simulator == SimulatorKind::device; }
};

INSTANTIATE_TEST_SUITE_P(Simulators, Belts, testing::ValuesIn(all_variants),
                         [](const auto& of) { return std::string(of.param.name); });

/// A belt 100 m long and 4 m wide, its surface at z = 0.
BodyDef belt(Vec3 velocity, Vec3 at = {}) {
  BodyDef def;
  def.motion = MotionType::fixed;
  def.shape = box({50, 2, 0.5f});
  def.pose.position = at - Vec3{0, 0, 0.5f};
  def.material.surface_velocity = velocity;
  return def;
}

/// A crate 80 cm wide and 40 cm high that stands at z = 0.
BodyDef crate(Vec3 at, float mass = 3) { return dynamic(box({0.4f, 0.4f, 0.2f}), at + Vec3{0, 0, 0.2f}, mass); }

/// N, over all contacts of the two bodies along their normals.
float normal_force(const World& world, BodyId a, BodyId b) {
  float sum = 0;
  world.for_each_contact([&](const ContactInfo& contact) {
    if (!((contact.a == a && contact.b == b) || (contact.a == b && contact.b == a))) return;
    for (int i = 0; i < contact.point_count; ++i) sum += contact.points[i].impulse;
  });
  return sum / dt;
}

TEST_P(Belts, ACrateReachesTheBeltsSpeedAndKeepsIt) {
  World world(quiet());
  world.add(belt({2, 0, 0}));
  const BodyId id = world.add(crate({0, 0, 0}));
  run(world, 12);
  EXPECT_NEAR(world.velocity(id).linear.x, 12 * dt * mu * g, 0.02f);
  run(world, 18);
  // v/(µg) = 0.408 s, over v²/(2µg) = 0.408 m.
  EXPECT_NEAR(world.velocity(id).linear.x, 2, 0.002f);
  EXPECT_NEAR(world.pose(id).position.x, 2 * 0.5f - 2 * 2 / (2 * mu * g), 0.02f);
  const float start = world.pose(id).position.x;
  for (int i = 0; i < 300; ++i) {
    world.step();
    ASSERT_NEAR(world.velocity(id).linear.x, 2, 0.002f) << i;
  }
  EXPECT_NEAR(world.pose(id).position.x - start, 10, 0.01f);
  EXPECT_NEAR(world.pose(id).position.y, 0, 1e-3f);
  EXPECT_LT(length(world.velocity(id).angular), 1e-3f);
}

TEST_P(Belts, ABallRollsAtTwoSeventhsOfTheSpeed) {
  World world(quiet());
  world.add(belt({1.4f, 0, 0}));
  const BodyId id = world.add(dynamic(sphere(0.3f), {0, 0, 0.3f}, 2));
  run(world, 120);
  EXPECT_NEAR(world.velocity(id).linear.x, 0.4f, 0.004f);
  EXPECT_NEAR(world.velocity(id).angular.y, -1 / 0.3f, 0.01f / 0.3f);
}

TEST_P(Belts, ABallThatBouncesTakesUpSpin) {
  World world(quiet());
  BodyDef def = belt({1.4f, 0, 0});
  def.material.restitution = 0.5f;
  world.add(def);
  const BodyId id = world.add(dynamic(sphere(0.3f), {0, 0, 1.5f}, 2));
  run(world, 45);  // it has bounced once
  EXPECT_GT(world.pose(id).position.z, 0.4f);
  EXPECT_NEAR(world.velocity(id).linear.x, 0.4f, 0.01f);
}

TEST_P(Belts, AWallHoldsACrateByTheForceOfFriction) {
  World world(quiet());
  const BodyId floor = world.add(belt({2, 0, 0}));
  BodyDef wall;
  wall.motion = MotionType::fixed;
  wall.shape = box({0.5f, 2, 2});
  wall.pose.position = {1.9f, 0, 2};
  wall.material = {.friction = 0, .friction_rule = CombineRule::minimum};
  const BodyId stop = world.add(wall), id = world.add(crate({1, 0, 0}));
  run(world, 240);
  EXPECT_NEAR(world.pose(id).position.x, 1, 0.005f);
  EXPECT_LT(length(world.velocity(id).linear), 0.01f);
  EXPECT_NEAR(normal_force(world, floor, id) / (3 * g), 1, 0.03f);
  EXPECT_NEAR(normal_force(world, stop, id) / (mu * 3 * g), 1, 0.03f);
}

TEST_P(Belts, ABeltCarriesUpASlopeWithinItsFriction) {
  for (const float tangent : {0.3f, 0.7f}) {
    World world(quiet());
    const float angle = std::atan(tangent);
    BodyDef slope = belt({1, 0, 0});
    slope.pose.rotation = axis_angle({0, 1, 0}, -angle);
    slope.pose.position = rotate(slope.pose.rotation, slope.pose.position);
    world.add(slope);
    BodyDef def = crate({0, 0, 0});
    def.pose = {rotate(slope.pose.rotation, def.pose.position), 0, slope.pose.rotation};
    const BodyId id = world.add(def);
    const Vec3 up = rotate(slope.pose.rotation, {1, 0, 0});
    run(world, 60);
    const float first = dot(world.velocity(id).linear, up);
    run(world, 60);
    const float then = dot(world.velocity(id).linear, up);
    if (tangent < mu)
      EXPECT_NEAR(then, 1, 0.001f);
    else
      EXPECT_NEAR(then - first, -g * (std::sin(angle) - mu * std::cos(angle)), 0.05f);
  }
}

TEST_P(Belts, ATrackedBodyDrives) {
  World world(quiet());
  world.add(ground());
  BodyDef def = crate({0, 0, 0.5f});
  def.pose.rotation = axis_angle({0, 0, 1}, 0.5f * pi);
  def.material.surface_velocity = {1.5f, 0, 0};
  const BodyId id = world.add(def);
  run(world, 120);
  EXPECT_NEAR(world.velocity(id).linear.y, -1.5f, 0.0015f);
  EXPECT_NEAR(world.velocity(id).linear.x, 0, 0.002f);
}

TEST_P(Belts, ImpulsesAreEqualAndOpposite) {
  World world(quiet());
  BodyDef ice = ground();
  ice.material = {.friction = 0, .friction_rule = CombineRule::minimum};
  world.add(ice);
  const BodyId slab = world.add(dynamic(box({5, 5, 0.2f}), {0, 0, 0.7f}, 12));
  BodyDef def = crate({0, 0, 0.9f}, 4);
  def.material.surface_velocity = {-1, 0, 0};
  const BodyId tank = world.add(def);
  run(world, 120);
  const float of_slab = world.velocity(slab).linear.x, of_tank = world.velocity(tank).linear.x;
  EXPECT_NEAR(of_tank - of_slab, 1, 0.002f);
  EXPECT_NEAR(4 * of_tank + 12 * of_slab, 0, 0.01f);
}

TEST_P(Belts, TwoBeltsTurnAPlank) {
  World world(quiet());
  world.add(belt({1, 0, 0}, {0, 2.05f, 0}));
  world.add(belt({-1, 0, 0}, {0, -2.05f, 0}));
  const BodyId id = world.add(dynamic(box({0.2f, 1.5f, 0.1f}), {0, 0, 0.1f}, 5));
  run(world, 60);
  EXPECT_LT(world.velocity(id).angular.z, is_exact() ? -0.5f : -0.2f);
  EXPECT_LT(std::hypot(world.pose(id).position.x, world.pose(id).position.y), is_exact() ? 0.05f : 1.0f);
}

TEST_P(Belts, AMovingBodyAddsItsOwnVelocity) {
  World world(quiet());
  BodyDef def = belt({0.5f, 0, 0});
  def.motion = MotionType::kinematic;
  def.velocity.linear = {0, 0.25f, 0};
  world.add(def);
  const BodyId id = world.add(crate({0, 0, 0}));
  run(world, 120);
  EXPECT_NEAR(world.velocity(id).linear.x, 0.5f, 0.0005f);
  EXPECT_NEAR(world.velocity(id).linear.y, 0.25f, 0.0005f);
}

TEST_P(Belts, AStackRidesAlong) {
  World world(quiet());
  world.add(belt({1, 0, 0}));
  std::vector<BodyId> ids;
  for (int i = 0; i < 5; ++i) ids.push_back(world.add(crate({0, 0, 0.4f * static_cast<float>(i)})));
  run(world, 240);
  for (const BodyId id : ids) {
    EXPECT_NEAR(world.velocity(id).linear.x, 1, is_exact() ? 0.001f : 0.1f);
    EXPECT_NEAR(world.pose(id).position.x, world.pose(ids[0]).position.x, is_exact() ? 0.05f : 0.2f);
    EXPECT_NEAR(world.pose(id).position.y, 0, is_exact() ? 0.01f : 0.1f);
  }
}

/// Too tall for sweeps: the direct solution of supports has to move with the belt.
TEST_P(Belts, AColumnRidesAlong) {
  if (GetParam().solver != Solver::soft || GetParam().partition != Partition::colours)
    GTEST_SKIP() << "sweeps alone hold no columns";
  for (const float speed : {0.2f, 2.0f}) {
    World world(quiet());
    world.add(belt({speed, 0, 0}));
    std::vector<BodyId> ids;
    for (int i = 0; i < 24; ++i) {
      ids.push_back(world.add(cube({0, 0, 0.5f + static_cast<float>(i)})));
      world.set_velocity(ids.back(), {speed, 0, 0}, {});
    }
    run(world, 1200);
    const Vec3 foot = world.pose(ids.front()).position, top = world.pose(ids.back()).position;
    EXPECT_NEAR(foot.x, 20 * speed, 0.01f);
    EXPECT_NEAR(top.x, foot.x, 0.01f);
    EXPECT_NEAR(top.z, 23.5f, 0.01f);
  }
}

TEST_P(Belts, BelowAHeavyLoadABeltStillMoves) {
  if (!is_exact()) GTEST_SKIP() << "it needs more time to carry such loads";
  World world(quiet());
  world.add(belt({0.2f, 0, 0}));
  const BodyId light = world.add(crate({0, 0, 0}, 1));
  const BodyId heavy = world.add(crate({0, 0, 0.4f}, 20));
  run(world, 300);
  EXPECT_NEAR(world.velocity(light).linear.x, 0.2f, 0.002f);
  EXPECT_NEAR(world.velocity(heavy).linear.x, 0.2f, 0.002f);
}

TEST_P(Belts, MeshesAndFieldsAreBeltsToo) {
  const std::vector<float> level(21 * 21, 0.0f);
  const Shape field = height_field({.columns = 21, .rows = 21, .cell_x = 1, .cell_y = 1, .heights = level});
  for (const bool is_field : {false, true}) {
    World world(quiet());
    BodyDef def;
    def.motion = MotionType::fixed;
    def.shape = is_field ? field : flat_mesh(20, 10);
    if (is_field) def.pose.position = {-10, -10, 0};
    def.material.surface_velocity = {0, 1, 0};
    world.add(def);
    const BodyId id = world.add(crate({0, -5, 0})), ball = world.add(dynamic(sphere(0.3f), {3, -5, 0.3f}));
    run(world, 120);
    EXPECT_NEAR(world.velocity(id).linear.y, 1, 0.001f);
    EXPECT_NEAR(world.velocity(id).linear.x, 0, 0.001f);
    EXPECT_NEAR(world.velocity(ball).linear.y, 2.0f / 7, 0.004f);
  }
}

TEST_P(Belts, AChildOfACompoundHasItsOwnAxes) {
  World world(quiet());
  Material moving;
  moving.surface_velocity = {1, 0, 0};
  BodyDef def;
  def.motion = MotionType::fixed;
  def.shape = compound(std::vector<ChildShape>{
      {.shape = box({4, 2, 0.5f}), .pose = {.position = {0, -3, -0.5f}}},
      {.shape = box({2, 4, 0.5f}),
       .pose = {.position = {0, 3, -0.5f}, .rotation = axis_angle({0, 0, 1}, 0.5f * pi)},
       .material = moving},
  });
  def.pose.position = def.shape.compound->offset();
  def.material.surface_velocity = {0.5f, 0, 0};
  world.add(def);
  const BodyId on_body = world.add(crate({-2, -3, 0})), on_child = world.add(crate({0, 2, 0}));
  run(world, 60);
  EXPECT_NEAR(world.velocity(on_body).linear.x, 0.5f, 0.001f);
  EXPECT_NEAR(world.velocity(on_child).linear.y, 1, 0.001f);
  EXPECT_NEAR(world.velocity(on_child).linear.x, 0, 0.001f);
}

TEST_P(Belts, WhatStandsStillSleepsAndWakesWithTheBelt) {
  World world(sleepy());
  const BodyId floor = world.add(belt({0.5f, 0, 0}));
  const BodyId id = world.add(crate({0, 0, 0})), top = world.add(crate({0, 0, 0.4f}));
  run(world, 120);
  EXPECT_TRUE(world.is_awake(id));
  Material still = world.material(floor);
  still.surface_velocity = {};
  world.set_material(floor, still);
  run(world, 120);
  EXPECT_FALSE(world.is_awake(id));
  const float start = world.pose(id).position.x;
  still.surface_velocity = {0, 0.5f, 0};
  world.set_material(floor, still);
  run(world, 60);
  EXPECT_TRUE(world.is_awake(id) && world.is_awake(top));
  EXPECT_NEAR(world.velocity(id).linear.y, 0.5f, 0.001f);
  EXPECT_NEAR(world.velocity(top).linear.y, 0.5f, 0.001f);
  EXPECT_NEAR(world.pose(id).position.x, start, 0.01f);
}

TEST_P(Belts, WhatABeltCarriesNeverSleepsHoweverSlow) {
  World world(sleepy());
  world.add(belt({0.01f, 0, 0}));
  const BodyId id = world.add(crate({0, 0, 0}));
  run(world, 600);
  EXPECT_TRUE(world.is_awake(id));
  EXPECT_NEAR(world.pose(id).position.x, 0.1f, 0.002f);
  // A tank moving as slowly.
  BodyDef def = crate({0, 20, 0});
  def.material.surface_velocity = {0, 0.01f, 0};
  world.add(belt({}, {0, 20, 0}));
  const BodyId tank = world.add(def);
  run(world, 600);
  EXPECT_TRUE(world.is_awake(tank));
  EXPECT_NEAR(world.pose(tank).position.y, 20 - 0.1f, 0.002f);
}

TEST_P(Belts, WhatIsHeldInPlaceMaySleep) {
  World world(sleepy());
  world.add(belt({1, 0, 0}));
  BodyDef wall;
  wall.motion = MotionType::fixed;
  wall.shape = box({0.5f, 2, 2});
  wall.pose.position = {1.9f, 0, 2};
  world.add(wall);
  const BodyId id = world.add(crate({1, 0, 0}));
  run(world, 240);
  EXPECT_FALSE(world.is_awake(id));
  EXPECT_NEAR(world.pose(id).position.x, 1, 0.01f);
}

void add_traffic(World& world) {
  world.add(belt({1, 0, 0}));
  world.add(belt({-0.5f, 0.2f, 0}, {0, 4, 0}));
  world.add(belt({}, {0, 8, 0}));
  const Shape shapes[] = {box({0.3f, 0.2f, 0.2f}), sphere(0.25f), capsule(0.15f, 0.2f), box({0.2f, 0.2f, 0.4f})};
  for (int i = 0; i < 120; ++i) {
    BodyDef def = dynamic(shapes[i % 4], {0.7f * static_cast<float>(i % 8), 0.8f * static_cast<float>(i / 8 % 10),
                                          0.6f + 0.9f * static_cast<float>(i / 80)});
    if (i % 7 == 0) def.material.surface_velocity = {0, 0.4f, 0};
    if (i % 5 == 0) def.material.rolling_resistance = 0.01f;
    if (i % 11 == 0) def.material.restitution = 0.5f;
    world.add(def);
  }
}

TEST_P(Belts, HashesAreThoseOfOneThread) {
  World one(sleepy(1)), two(sleepy(2)), four(sleepy(4));
  for (World* world : {&one, &two, &four}) add_traffic(*world);
  for (int i = 0; i < 120; ++i) {
    for (World* world : {&one, &two, &four}) world->step();
    ASSERT_EQ(one.state_hash(), two.state_hash()) << i;
    ASSERT_EQ(one.state_hash(), four.state_hash()) << i;
  }
  EXPECT_TRUE(one.quarantined().empty());
}

TEST_P(Belts, SnapshotsGoOnAlike) {
  World world(sleepy()), other(sleepy());
  add_traffic(world);
  run(world, 60);
  other.restore(saved(world));
  for (int i = 0; i < 60; ++i) {
    world.step(), other.step();
    ASSERT_EQ(world.state_hash(), other.state_hash()) << i;
  }
}

TEST_P(Belts, OthersAreAsWithoutThem) {
  World with(quiet()), without(quiet());
  for (World* world : {&with, &without}) {
    world->add(belt(world == &with ? Vec3{1, 0, 0} : Vec3{}));
    world->add(belt({}, {0, 10, 0}));
    world->add(crate({0, 0, 0}));
  }
  std::vector<BodyId> ids;
  for (int i = 0; i < 12; ++i)
    for (World* world : {&with, &without}) {
      BodyDef def = crate({0.1f * static_cast<float>(i % 3), 10, 0.42f * static_cast<float>(i)});
      def.velocity.linear = {1, 0.2f, 0};
      const BodyId id = world->add(def);
      if (world == &with) ids.push_back(id);
    }
  run(with, 120);
  run(without, 120);
  for (const BodyId id : ids) {
    EXPECT_TRUE(with.pose(id).position == without.pose(id).position);
    EXPECT_TRUE(with.velocity(id).linear == without.velocity(id).linear);
  }
}

TEST_P(Belts, RefuseWhatIsNotFinite) {
  World world(quiet());
  const BodyId id = world.add(belt({1, 0, 0}));
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 2e6f}) {
    try {
      world.set_material(id, {.surface_velocity = {0, bad, 0}});
      ADD_FAILURE() << bad;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::invalid_argument);
      EXPECT_NE(std::string(error.what()).find("set material: the surface velocity is (0, "), std::string::npos)
          << error.what();
    }
    EXPECT_EQ(world.material(id).surface_velocity.x, 1);
  }
}

}  // namespace
}  // namespace fathom::test::belt_test
