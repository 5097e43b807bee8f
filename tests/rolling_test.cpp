// Rolling resistance, and how round bodies come to rest.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "world_fixture.hpp"

namespace fathom::rolling_test {
namespace {

using namespace test;

constexpr float g = 9.81f;

/// A ball of radius 0.5 m that rolls along x over the ground, or about an axis in the ground.
BodyDef ball(float speed, float resistance) {
  BodyDef def = dynamic(sphere(0.5f), {0, 0, 1}, 2);
  def.velocity = {{speed, 0, 0}, 0, {0, 2 * speed, 0}, 0};
  def.material.rolling_resistance = resistance;
  return def;
}

/// A capsule of radius 0.5 m on its side.
BodyDef roller(float speed, float resistance) {
  BodyDef def = ball(speed, resistance);
  def.shape = capsule(0.5f, 0.7f);
  def.pose.rotation = axis_angle({1, 0, 0}, 0.5f * pi);
  return def;
}

/// Gravity on a plane that descends in direction x with this tangent.
Vec3 slope(float tangent) {
  const float c = 1 / std::sqrt(1 + tangent * tangent);
  return {g * tangent * c, 0, -g * c};
}

/// Fraction of a couple about the contact that brakes a rolling body's speed: 1 / (1 + I / (m r²)).
float braking_share(const World& world, BodyId id) {
  const float moment = min_component(world.mass_properties(id).principal_moments);
  return 1 / (1 + moment / (world.mass(id) * 0.25f));
}

WorldDef with(Solver method, bool warm_start) {
  WorldDef def = quiet_world();
  def.solver.method = method;
  def.solver.warm_start = warm_start;
  return def;
}

const WorldDef all_solvers[] = {with(Solver::soft, true), with(Solver::impulse, true), with(Solver::soft, false)};

}  // namespace

TEST(Rolling, ResistanceTakesSpeedEvenly) {
  for (const WorldDef& def : all_solvers)
    for (const auto make : {ball, roller}) {
      World world(def);
      world.add(ground());
      const BodyId id = world.add(make(2, 0.05f));
      run(world, 60);
      const float start = world.velocity(id).linear.x, share = braking_share(world, id);
      run(world, 120);
      EXPECT_NEAR((start - world.velocity(id).linear.x) / (2 * share * 0.05f * g), 1, 0.03f);
      run(world, 480);
      EXPECT_LT(length(world.velocity(id).linear), 1e-3f);
      EXPECT_LT(length(world.velocity(id).angular), 2e-3f);
    }
}

TEST(Rolling, ResistanceHoldsASlopeUpToItsTangent) {
  for (const auto make : {ball, roller}) {
    WorldDef def = quiet_world();
    def.gravity = slope(0.045f);
    World holds(def);
    holds.add(ground());
    const BodyId still = holds.add(make(0, 0.05f));
    run(holds, 600);
    EXPECT_LT(std::abs(holds.pose(still).position.x), 2e-3f);
    EXPECT_LT(length(holds.velocity(still).linear), 1e-4f);

    def.gravity = slope(0.08f);
    World rolls(def);
    rolls.add(ground());
    const BodyId moving = rolls.add(make(0, 0.05f));
    run(rolls, 120);
    const float expected = braking_share(rolls, moving) * 0.03f * g * 2;
    EXPECT_NEAR(rolls.velocity(moving).linear.x / expected, 1, 0.05f);
  }
}

TEST(Rolling, TheLargerResistanceCounts) {
  World world(quiet_world());
  BodyDef floor = ground();
  floor.material.rolling_resistance = 0.04f;
  world.add(floor);
  BodyDef one = ball(2, 0.01f), other = ball(2, 0.1f);
  other.pose.position.y = 3;
  const BodyId a = world.add(one), b = world.add(other);
  run(world, 60);
  EXPECT_NEAR(2 - world.velocity(a).linear.x, 0.04f * g * 5 / 7, 0.02f);
  EXPECT_NEAR(2 - world.velocity(b).linear.x, 0.1f * g * 5 / 7, 0.04f);
}

TEST(Rolling, ResistanceCanBeChangedAndSaved) {
  World world(quiet_world());
  world.add(ground());
  const BodyId id = world.add(ball(2, 0));
  run(world, 60);
  EXPECT_NEAR(world.velocity(id).linear.x, 2, 5e-3f);
  world.set_material(id, {.rolling_resistance = 0.1f});
  run(world, 30);
  std::vector<std::byte> bytes;
  world.save(bytes);
  World other(quiet_world());
  other.restore(bytes);
  EXPECT_EQ(other.material(id).rolling_resistance, 0.1f);
  for (int i = 0; i < 30; ++i) {
    world.step();
    other.step();
    ASSERT_EQ(world.state_hash(), other.state_hash());
  }
  EXPECT_NEAR(2 - world.velocity(id).linear.x, 0.1f * g * 5 / 7, 0.05f);
  world.set_material(id, {.rolling_resistance = 0});
  const float left = world.velocity(id).linear.x;
  run(world, 60);
  EXPECT_NEAR(world.velocity(id).linear.x, left, 5e-3f);
}

// Contacts share vectors. One that has lost its resistance does not carry its last impulse on when another has some.
TEST(Rolling, LostResistanceLeavesNothingBehind) {
  std::vector<Velocity> velocities;
  for (const float resistance_beside : {0.0f, 0.1f}) {
    World world(quiet_world());
    world.add(ground());
    const BodyId id = world.add(ball(2, 0.1f));
    BodyDef beside = ball(2, resistance_beside);
    beside.pose.position.y = 20;
    world.add(beside);
    run(world, 30);
    world.set_material(id, {});
    run(world, 30);
    velocities.push_back(world.velocity(id));
  }
  EXPECT_EQ(velocities[0].linear, velocities[1].linear);
  EXPECT_EQ(velocities[0].angular, velocities[1].angular);
}

TEST(Rolling, ResistanceLeavesFlightAndBoxesAlone) {
  WorldDef def = quiet_world();
  World with(def), without(def);
  for (World* world : {&with, &without}) {
    BodyDef floor = ground();
    floor.material.rolling_resistance = world == &with ? 0.5f : 0.0f;
    world->add(floor);
    BodyDef box = cube({0, 0, 1.2f});
    box.velocity = {{2, 0.5f, 0}, 0, {0.3f, 0, 1}, 0};
    world->add(box);
    BodyDef flying = ball(3, 0);
    flying.pose.position.z = 40;
    world->add(flying);
  }
  run(with, 120);
  run(without, 120);
  EXPECT_EQ(with.state_hash(), without.state_hash());
}

TEST(Rolling, WithoutResistanceBallsKeepTheirSpeed) {
  World world(sleepy_world());
  world.add(ground());
  const BodyId id = world.add(ball(1, 0));
  run(world, 600);
  EXPECT_NEAR(world.velocity(id).linear.x, 1, 0.01f);
}

/// µ N times a lever of 3π/16 · R/100.
TEST(Rolling, FrictionBrakesTheSpinOfABall) {
  World world(quiet_world());
  world.add(ground());
  BodyDef def = ball(0, 0);
  def.velocity.angular = {0, 0, 5};
  const BodyId id = world.add(def);
  run(world, 30);
  const float start = world.velocity(id).angular.z;
  run(world, 300);
  const float expected = 5 * 0.5f * 2 * g * 0.589f * 0.005f / (0.4f * 2 * 0.25f);
  EXPECT_NEAR((start - world.velocity(id).angular.z) / expected, 1, 0.03f);
}

/// It loses some of its speed from face to face, a fraction of about (π/32)².
TEST(Rolling, ACylinderRollsDownASlope) {
  for (const Vec3 axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}})
    for (const float radius : {0.5f, 5.0f}) {
      WorldDef def = quiet_world();
      def.gravity = axis.x > 0 ? Vec3{0, -2, -9.6f} : Vec3{2, 0, -9.6f};
      World world(def);
      world.add(ground());
      BodyDef rod = dynamic(cylinder(radius, 0.7f * radius), {0, 0, 0.5f + 1.004f * radius}, 2);
      rod.pose.rotation = axis.x > 0 ? axis_angle({0, 1, 0}, 0.5f * pi) : axis_angle({1, 0, 0}, 0.5f * pi);
      const BodyId id = world.add(rod);
      run(world, 60);
      const Vec3 moved = world.pose(id).position;
      // Half of 2/3 of its slide without friction.
      EXPECT_NEAR((axis.x > 0 ? -moved.y : moved.x), 2.0f / 3, 0.1f) << radius;
      EXPECT_NEAR((moved.z - 0.5f) / radius, 1, 0.01f) << radius;
    }
}

TEST(Rolling, RoundBodiesComeToRestAndSleep) {
  std::vector<Vec3> rim;
  for (int i = 0; i < 32; ++i)
    for (const float y : {-0.5f, 0.5f}) {
      const float angle = 2 * pi * static_cast<float>(i) / 32;
      rim.push_back({0.5f * std::cos(angle), y, 0.5f * std::sin(angle)});
    }
  World world(sleepy_world());
  world.add(ground());
  std::vector<BodyId> ids;
  const auto add = [&](BodyDef def, Velocity velocity) {
    def.pose.position.y = 6 * static_cast<float>(ids.size());
    def.velocity = velocity;
    ids.push_back(world.add(def));
  };
  add(ball(0, 0), {{0.09f, 0, 0}, 0, {0, 0.18f, 0}, 0});
  add(ball(0, 0), {{}, 0, {0, 0, 3}, 0});
  add(ball(0, 0.02f), {{1.5f, 0, 0}, 0, {0, 3, 0}, 0});
  add(roller(0, 0), {{0.09f, 0, 0}, 0, {0, 0.18f, 0}, 0});
  add(roller(0, 0.02f), {{1, 0, 0}, 0, {0, 2, 0}, 0});
  add(roller(0, 0), {{}, 0, {0, 0, 3}, 0});
  BodyDef cylinder = ball(0, 0);
  cylinder.shape = hull(rim);
  add(cylinder, {{0.5f, 0, 0}, 0, {0, 1, 0}, 0});
  cylinder.pose.rotation = axis_angle({1, 0, 0}, 0.5f * pi);
  add(cylinder, {{0.5f, 0, 0}, 0, {0, 0, 3}, 0});
  run(world, 35 * 60);
  for (std::size_t i = 0; i < ids.size(); ++i) EXPECT_FALSE(world.is_awake(ids[i])) << i;
}

}  // namespace fathom::rolling_test
