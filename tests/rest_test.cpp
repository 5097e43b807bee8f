// Undisturbed bodies come to rest: of any shape and size, alone on a floor, a few together, and on rough ground.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "dynamics/free_way.hpp"
#include "random.hpp"
#include "test_surfaces.hpp"
#include "world_fixture.hpp"

namespace fathom::test::rest_test {
namespace {

BodyDef fixed_at(const Shape& shape, Vec3 position) {
  BodyDef def;
  def.motion = MotionType::fixed;
  def.shape = shape;
  def.pose.position = position;
  return def;
}

enum class Kind { plate, splinter, cylinder, any };

float logarithmic(Generator& random, float lo, float hi) {
  return std::exp(uniform(random, std::log(lo), std::log(hi)));
}

/// About `size` (m) wide, with a thickness down to the fraction `thinnest` of it.
Shape any_shape(Generator& random, float size, float thinnest, Kind kind) {
  const float thin = logarithmic(random, thinnest, 1);
  if (kind == Kind::cylinder) return cylinder(0.5f * size, 0.5f * size * thin);
  if (kind == Kind::plate || (kind == Kind::any && random() % 2 == 0))
    return box({size, size * uniform(random, 0.4f, 1), 0.6f * size * thin});
  std::vector<Vec3> points;
  for (int i = 0; i < 12; ++i) {
    const Vec3 p = in_cube(random);
    points.push_back(0.7f * size * Vec3{p.x, p.y, thin * p.z});
  }
  return hull(points);
}

/// Whether it is awake and has turned in the last quarter of its time, and whether it ended below.
struct Rest {
  bool is_restless = false, is_below = false;
};

Rest rest_alone(WorldDef def, std::uint32_t seed, float size) {
  Generator random(seed);
  World world(def);
  world.add(fixed_at(box({50, 50, 1}), {0, 0, -1}));
  const float speed = std::sqrt(2 * 9.81f * size);
  BodyDef body;
  body.shape = any_shape(random, size, 0.03f, Kind::splinter);
  body.pose = {{0, 0, uniform(random, 1.5f, 4) * size}, 0, any_rotation(random)};
  body.velocity = {speed * in_cube(random), 0, 5.0f * in_cube(random)};
  const BodyId id = world.add(body);
  Rest rest;
  const int steps = static_cast<int>(8 / def.dt);
  for (int i = 0; i < steps; ++i) {
    world.step();
    if (i > 3 * steps / 4) rest.is_restless |= world.is_awake(id) && length(world.velocity(id).angular) > 0.3f;
  }
  rest.is_restless &= world.is_awake(id);
  rest.is_below = world.pose(id).position.z < 0;
  return rest;
}

TEST(Rest, ASplinterAloneOnAFloorComesToRest) {
  for (const float size : {0.003f, 0.02f, 0.1f}) {
    int restless = 0, below = 0;
    for (std::uint32_t seed = 1; seed <= 60; ++seed) {
      const Rest rest = rest_alone(sleepy_world(), seed, size);
      restless += rest.is_restless, below += rest.is_below;
    }
    EXPECT_LE(restless, 1) << size << " m";
    EXPECT_LE(below, 1) << size << " m";
  }
}

/// Counts the restless ones of `count` pits with `bodies` bodies each.
int restless_pits(const Shape* ground, int count, int bodies, Kind kind,
                  SimulatorKind simulator = SimulatorKind::native) {
  int restless = 0;
  for (int seed = 1; seed <= count; ++seed) {
    Generator random(static_cast<std::uint32_t>(seed));
    WorldDef def = ground ? WorldDef{.threads = 1} : sleepy_world();
    def.simulator = simulator, def.device = test_device();
    World world(def);
    constexpr float unit = 0.2f, width = 0.8f;
    world.add(ground ? fixed_at(*ground, {}) : fixed_at(box({8, 8, 1}), {0, 0, -1}));
    for (const float side : {-1.2f * width, 1.2f * width}) {
      world.add(fixed_at(box({0.2f, 1.4f, 1}), {side, 0, 0.8f}));
      world.add(fixed_at(box({1.4f, 0.2f, 1}), {0, side, 0.8f}));
    }
    std::vector<BodyId> ids;
    for (int i = 0; i < bodies; ++i) {
      BodyDef body;
      body.shape = any_shape(random, unit * uniform(random, 0.5f, 1), 0.1f, kind);
      body.pose = {
          {0.3f * uniform(random, -1, 1), 0.3f * uniform(random, -1, 1), unit * (1.5f + 1.5f * static_cast<float>(i))},
          0,
          any_rotation(random)};
      ids.push_back(world.add(body));
    }
    for (int i = 0; i < 480 + 20 * bodies; ++i) world.step();
    restless += std::ranges::any_of(
        ids, [&](BodyId id) { return world.is_awake(id) && length(world.velocity(id).angular) > 0.3f; });
    for (const BodyId id : ids) EXPECT_GT(world.pose(id).position.z, -0.2f) << "pit " << seed;
  }
  return restless;
}

TEST(Rest, PlatesThatLeanOnEachOtherComeToRest) {
  EXPECT_LE(restless_pits(nullptr, 100, 3, Kind::plate), 2);
  EXPECT_LE(restless_pits(nullptr, 50, 10, Kind::any), 2);
}

// A leaning face must keep the corners that it comes down on next.
TEST(Rest, CylindersComeToRest) {
  EXPECT_LE(restless_pits(nullptr, 60, 10, Kind::cylinder), 3);
  EXPECT_LE(restless_pits(nullptr, 30, 10, Kind::cylinder, SimulatorKind::device), 3);
}

TEST(Rest, WhatLiesOnRoughGroundComesToRest) {
  const Shape ground = grid_mesh(40, 1.6f, [](float x, float y) { return 0.04f * std::sin(6 * x) * std::sin(5 * y); });
  EXPECT_LE(restless_pits(&ground, 100, 1, Kind::any), 4);
}

/// A body lifted out of a surface never gains energy from it.
TEST(Rest, ALiftTakesEnergyAndNeverGivesAny) {
  Generator random(3);
  for (int round = 0; round < 2000; ++round) {
    FreeWay way;
    way.is_free = false, way.is_lifted = true;
    way.normal = on_sphere(random);
    const Pose pose = any_pose(random, 1);
    const float mass = logarithmic(random, 1e-6f, 1e3f), size = logarithmic(random, 1e-3f, 10);
    way.at = pose.position + size * in_cube(random);
    const Vec3 moments =
        mass * size * size * Vec3{uniform(random, 0.3f, 1), uniform(random, 0.3f, 1), uniform(random, 0.3f, 1)};
    const SymMat3 inverse{1 / moments.x, 1 / moments.y, 1 / moments.z, 0, 0, 0};
    const Velocity before{3.0f * in_cube(random), 0, (3 / size) * in_cube(random)};
    const Velocity after = stopped(way, {}, {}, pose.position, before, pose, 1 / mass, 0, inverse);
    const auto energy = [&](const Velocity& v) {
      const Vec3 spin = inverse_rotate(pose.rotation, v.angular);
      return mass * length_squared(v.linear) +
             dot(spin, Vec3{moments.x * spin.x, moments.y * spin.y, moments.z * spin.z});
    };
    EXPECT_LE(energy(after), energy(before) * 1.0001f) << round;
    EXPECT_GE(dot(way.normal, after.linear), -1e-4f) << round;
  }
}

}  // namespace
}  // namespace fathom::test::rest_test
