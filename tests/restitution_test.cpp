// Bouncing: chains of hits, flat falls, energy, and coming to rest.
#include <gtest/gtest.h>

#include <fathom/world.hpp>
#include <vector>

#include "random.hpp"
#include "world_fixture.hpp"

namespace fathom::test::restitution_test {
namespace {

WorldDef bouncing_world() {
  WorldDef def = quiet_world();
  def.solver.restitution_threshold = 0;
  return def;
}

BodyDef elastic(BodyDef def, float friction, float restitution) {
  def.material = {friction, restitution};
  return def;
}

/// Kinetic energy (J) of a cube or ball: its inertia is a multiple of the identity.
double kinetic_energy(const World& world, BodyId id, double mass, double inertia) {
  const Velocity v = world.velocity(id);
  return 0.5 * (mass * static_cast<double>(length_squared(v.linear)) +
                inertia * static_cast<double>(length_squared(v.angular)));
}

}  // namespace

// Newton's cradle: a hit on a row of balls is transmitted within one step, whatever their order in memory. The device's
// restitution pass reaches less far (docs/limits.md).
TEST(Restitution, ARowOfBallsPassesAHitOn) {
  for (const int count : {7, 60})
    for (const float gap : {0.0f, 0.001f}) {
      WorldDef def = bouncing_world();
      if (count > 7 && def.simulator == SimulatorKind::device) continue;
      def.gravity = {};
      World world(def);
      std::vector<BodyId> ids(static_cast<std::size_t>(count));
      for (int k = 0; k < count; ++k) {
        const int i = (3 + 23 * k) % count;
        ids[static_cast<std::size_t>(i)] =
            world.add(elastic(dynamic(sphere(0.5f), {static_cast<float>(i) * (1 + gap), 0, 0}, 2), 0.5f, 1));
      }
      BodyDef first = elastic(dynamic(sphere(0.5f), {-1.5f, 0, 0}, 2), 0.5f, 1);
      first.velocity.linear = {3, 0, 0};
      const BodyId striker = world.add(first);
      for (int i = 0; i < 60; ++i) world.step();
      EXPECT_NEAR(world.velocity(striker).linear.x, 0, 1e-5);
      EXPECT_NEAR(world.velocity(ids.back()).linear.x, 3, 1e-5) << count;
      ids.pop_back();
      for (const BodyId id : ids) EXPECT_NEAR(world.velocity(id).linear.x, 0, 1e-5) << count;
    }
}

// Two balls fall on each other: the upper one rises to nine times the height if its mass is negligible.
TEST(Restitution, ALightBallOnAHeavyOneRisesHigh) {
  WorldDef def = bouncing_world();
  def.dt = 1.0f / 240;
  World world(def);
  world.add(ground(0, 1));
  world.add(elastic(dynamic(sphere(0.5f), {0, 0, 2}, 1000), 0, 1));
  const BodyId light = world.add(elastic(dynamic(sphere(0.1f), {0, 0, 2.61f}, 1), 0, 1));
  float top = 0;
  for (int i = 0; i < 480; ++i) {
    world.step();
    if (world.velocity(light).linear.z > 0) top = max(top, world.pose(light).position.z);
  }
  // From v and −v with a mass ratio of 1,000 the light one leaves at (3 − 1/1000)/(1 + 1/1000) v, at a height of 1.6 m.
  const float speed = std::sqrt(2 * 9.81f) * (2.999f / 1.001f);
  EXPECT_NEAR(top, 1.6f + speed * speed / (2 * 9.81f), 0.3f);
}

TEST(Restitution, WhatFallsFlatRisesFlat) {
  for (const float e : {0.5f, 1.0f}) {
    World world(bouncing_world());
    world.add(ground(0.5f, e));
    const BodyId id = world.add(elastic(dynamic(box({0.5f, 0.7f, 0.2f}), {0, 0, 1.7f}), 0.5f, e));
    float top = 0;
    bool rises = false;
    for (int i = 0; i < 120; ++i) {
      world.step();
      const Velocity v = world.velocity(id);
      EXPECT_LT(length(v.angular), 1e-3f);
      rises = rises || v.linear.z > 0;
      if (rises && v.linear.z < 0) break;
      if (rises) top = max(top, world.pose(id).position.z - 0.7f);
    }
    EXPECT_NEAR(top, e * e, 0.01f * e * e);
  }
}

// Cubes in a closed room without gravity: none gains energy, and without friction next to none is lost at e = 1.
TEST(Restitution, CubesInARoomKeepTheirEnergy) {
  for (const float friction : {0.0f, 0.5f}) {
    WorldDef def = bouncing_world();
    def.gravity = {};
    def.dt = 1.0f / 120;
    World world(def);
    for (int axis = 0; axis < 3; ++axis)
      for (const float side : {-1.0f, 1.0f}) {
        BodyDef wall = ground(friction, 1);
        Vec3 half{6, 6, 6}, place{};
        (axis == 0 ? half.x : axis == 1 ? half.y : half.z) = 1;
        (axis == 0 ? place.x : axis == 1 ? place.y : place.z) = side * 5;
        wall.shape = box(half);
        wall.pose.position = place;
        world.add(wall);
      }
    Generator random(7);
    std::vector<BodyId> ids;
    for (int i = 0; i < 27; ++i) {
      const auto at = [](int k) { return 2.0f * static_cast<float>(k) - 2.0f; };
      BodyDef def_of_cube = elastic(cube({at(i % 3), at(i / 3 % 3), at(i / 9)}), friction, 1);
      def_of_cube.velocity.linear = 4 * in_cube(random);
      ids.push_back(world.add(def_of_cube));
    }
    const auto energy = [&] {
      double sum = 0;
      for (const BodyId id : ids) sum += kinetic_energy(world, id, 1, 1.0 / 6);
      return sum;
    };
    const double start = energy();
    double most = start;
    for (int i = 0; i < 1200; ++i) {
      world.step();
      most = std::max(most, energy());
    }
    EXPECT_LT(most, 1.02 * start) << "friction " << friction;
    if (friction == 0) {
      EXPECT_GT(energy(), 0.9 * start);
    }
  }
}

TEST(Restitution, StacksOfWhatBouncesComeToRest) {
  WorldDef def = sleepy_world();
  World world(def);
  world.add(ground(0.5f, 0.6f));
  std::vector<BodyId> ids;
  for (int i = 0; i < 5; ++i)
    ids.push_back(world.add(elastic(cube({0, 0, 1.2f + 1.2f * static_cast<float>(i)}), 0.5f, 0.6f)));
  for (int i = 0; i < 900; ++i) world.step();
  for (std::size_t i = 0; i < ids.size(); ++i) {
    EXPECT_LT(length(world.velocity(ids[i]).linear), 1e-3f);
    EXPECT_NEAR(world.pose(ids[i]).position.z, 1 + static_cast<float>(i), 0.02f);
  }
}

// A plate rising at 2 m/s throws bodies on it at no more than (1 + e) times that speed.
TEST(Restitution, AMovingPlateIsMet) {
  WorldDef def = bouncing_world();
  def.gravity = {};
  World world(def);
  BodyDef plate = ground(0, 1);
  plate.motion = MotionType::kinematic;
  plate.velocity.linear = {0, 0, 2};
  world.add(plate);
  const BodyId ball = world.add(elastic(dynamic(sphere(0.5f), {0, 0, 1.3f}), 0, 1));
  for (int i = 0; i < 60; ++i) world.step();
  EXPECT_NEAR(world.velocity(ball).linear.z, 4, 1e-4);
}

}  // namespace fathom::test::restitution_test
