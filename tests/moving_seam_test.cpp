// Seams between kinematic bodies, and between these and fixed ones (collision/seam.hpp, dynamics/drift.hpp).
#include <gtest/gtest.h>

#include <algorithm>
#include <fathom/compound.hpp>
#include <fathom/mesh.hpp>
#include <functional>
#include <utility>
#include <vector>

#include "random.hpp"
#include "world_fixture.hpp"

namespace fathom::test::moving_seam_test {
namespace {

constexpr float half = 0.5f;  // of a tile's edges (m)

BodyDef tile(MotionType motion, const Shape& shape, Vec3 position) {
  BodyDef def;
  def.motion = motion;
  def.shape = shape;
  def.pose.position = position;
  def.material.friction = 0;
  return def;
}

/// A cube whose top is at height 0, by its number along x and y.
BodyDef cube_tile(MotionType motion, int i, int j) {
  return tile(motion, box({half, half, half}),
              {2 * half * static_cast<float>(i), 2 * half * static_cast<float>(j), -half});
}

std::vector<Shape> sliders() {
  constexpr float size = 0.2f;
  std::vector<Vec3> corners;
  for (int i = 0; i < 7; ++i) {
    const float angle = 2 * pi * static_cast<float>(i) / 7;
    const Vec3 side{std::cos(angle), std::sin(angle), 0};
    corners.push_back(1.2f * size * side + Vec3{0, 0, -size});
    corners.push_back(size * side + Vec3{0, 0, 0.5f * size});
  }
  return {box({size, size, size}), sphere(size), box({5 * size, size, 0.1f * size}), hull(corners)};
}

/// A body at rest above (x, 0, 0).
BodyId add_slider(World& world, const Shape& shape, float x) {
  BodyDef def = dynamic(shape, {});
  def.material.friction = 0;
  def.pose.rotation = axis_angle({0, 0, 1}, 0.2f);
  const BodyId body = world.add(def);
  def.pose.position = {x, 0.13f, -world.bounds(body).lower.z};
  world.set_pose(body, def.pose);
  return body;
}

/// Moves the kinematic bodies to where they are at this time (s).
using Course = std::function<void(float time)>;

/// Lets the body come to rest, gives it this velocity and expects it to keep that and its height for some steps.
void expect_undisturbed(World& world, BodyId body, Vec3 velocity, float speed, int steps, const Course& course) {
  run(world, 30);
  const float height = world.pose(body).position.z;
  world.set_velocity(body, velocity, {});
  float off = 0;
  for (int i = 0; i < steps; ++i) {
    course(static_cast<float>(i + 1) * world.definition().dt);
    world.step();
    off = std::max(off, std::abs(world.pose(body).position.z - height));
  }
  EXPECT_LT(off, 1e-3f);
  EXPECT_LT(length(world.velocity(body).linear - velocity), 1e-3f * speed);
}

const Course stay = [](float) {};

std::string name_of(std::size_t shape, float speed) {
  return "shape " + std::to_string(shape) + " at " + std::to_string(speed) + " m/s";
}

TEST(MovingSeams, NothingCatchesOnALiftAtRest) {
  const std::vector<Shape> shapes = sliders();
  for (std::size_t k = 0; k < shapes.size(); ++k)
    for (const float speed : {1.0f, 8.0f, 30.0f}) {
      World world(quiet_world());
      for (int i = -1; i < 13; ++i)
        for (int j = -2; j <= 2; ++j)
          world.add(cube_tile(i % 4 == 2 ? MotionType::kinematic : MotionType::fixed, i, j));
      const BodyId body = add_slider(world, shapes[k], 0);
      SCOPED_TRACE(name_of(k, speed));
      expect_undisturbed(world, body, {speed, 0, 0}, speed, static_cast<int>(60 * 8 / speed), stay);
    }
}

TEST(MovingSeams, KinematicMeshesAndCompoundsJoinTheFloor) {
  const std::vector<Vec3> corners{{-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}};
  const std::vector<std::uint32_t> triangles{0, 1, 2, 0, 2, 3};
  const Shape square = mesh(corners, triangles), half_box = box({0.5f * half, half, half});
  const std::vector<ChildShape> halves{{.shape = half_box, .pose = {.position = {-0.5f * half, 0, 0}}},
                                       {.shape = half_box, .pose = {.position = {0.5f * half, 0, 0}}}};
  const Shape two = compound(halves), one = box({half, half, half});
  const std::vector<Shape> shapes = sliders();
  for (std::size_t k = 0; k < shapes.size(); ++k)
    for (const float speed : {1.0f, 8.0f}) {
      World world(quiet_world());
      for (int i = -1; i < 11; ++i)
        for (int j = -2; j <= 2; ++j) {
          const MotionType motion = (i + j) % 2 == 0 ? MotionType::kinematic : MotionType::fixed;
          const Shape& shape = i % 3 == 0 ? square : i % 3 == 1 ? two : one;
          const float z = i % 3 == 0 ? 0 : -half;
          world.add(tile(motion, shape, {2 * half * static_cast<float>(i), 2 * half * static_cast<float>(j), z}));
        }
      const BodyId body = add_slider(world, shapes[k], 0);
      SCOPED_TRACE(name_of(k, speed));
      expect_undisturbed(world, body, {speed, 0, 0}, speed, static_cast<int>(60 * 8 / speed), stay);
    }
}

TEST(MovingSeams, NothingCatchesOnAPlatformOfSeveralBodies) {
  const Velocity together{{0.7f, -0.3f, 0}, 0, {}, 0};
  const std::vector<Shape> shapes = sliders();
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    World world(quiet_world());
    for (int i = -1; i < 11; ++i)
      for (int j = -2; j <= 2; ++j) {
        BodyDef def = cube_tile(MotionType::kinematic, i, j);
        def.velocity = together;
        world.add(def);
      }
    const BodyId body = add_slider(world, shapes[k], 0);
    world.set_velocity(body, together.linear, {});
    SCOPED_TRACE(name_of(k, 2));
    expect_undisturbed(world, body, together.linear + Vec3{2, 0, 0}, 2, 200, stay);
  }
}

/// Kinematic tiles around (5, 0, 0).
std::vector<std::pair<BodyId, Vec3>> add_platform(World& world) {
  std::vector<std::pair<BodyId, Vec3>> tiles;
  for (int i = -2; i < 13; ++i)
    for (int j = -7; j <= 7; ++j) {
      const BodyDef def = cube_tile(MotionType::kinematic, i, j);
      tiles.emplace_back(world.add(def), def.pose.position);
    }
  return tiles;
}

TEST(MovingSeams, NothingCatchesOnAPlatformThatTurns) {
  const std::vector<Shape> shapes = sliders();
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    World world(quiet_world());
    const auto tiles = add_platform(world);
    const BodyId body = add_slider(world, shapes[k], 0);
    SCOPED_TRACE(name_of(k, 3));
    expect_undisturbed(world, body, {3, 0, 0}, 3, 180, [&](float time) {
      const Vec3 centre{5, 0, 0};
      const Quat turn = axis_angle({0, 0, 1}, 0.3f * time);
      for (const auto& [id, at] : tiles)
        world.move_to(id, {.position = centre + rotate(turn, at - centre), .rotation = turn});
    });
  }
}

// What is carried up keeps its speed along the platform.
TEST(MovingSeams, NothingCatchesOnAPlatformThatRises) {
  const std::vector<Shape> shapes = sliders();
  for (std::size_t k = 0; k < shapes.size(); ++k)
    for (const float speed : {1.0f, 8.0f}) {
      World world(quiet_world());
      const auto tiles = add_platform(world);
      const BodyId body = add_slider(world, shapes[k], 0);
      run(world, 30);
      const float height = world.pose(body).position.z;
      world.set_velocity(body, {speed, 0, 0}, {});
      for (int i = 1; i <= static_cast<int>(60 * 10 / speed); ++i) {
        const float rise = 0.3f * (1 - std::cos(static_cast<float>(i) / 60));
        for (const auto& [id, at] : tiles) world.move_to(id, {.position = at + Vec3{0, 0, rise}});
        world.step();
        ASSERT_NEAR(world.pose(body).position.z - rise, height, 1e-3f) << name_of(k, speed) << ", step " << i;
      }
      EXPECT_NEAR(world.velocity(body).linear.x, speed, 1e-3f * speed) << name_of(k, speed);
    }
}

// Rows of tiles run along themselves at several speeds. None leaves the place beside the others.
TEST(MovingSeams, NothingCatchesOnBeltsThatRunBesideEachOther) {
  const std::vector<Shape> shapes = sliders();
  for (std::size_t k = 0; k < shapes.size(); ++k)
    for (const float speed : {1.0f, 4.0f}) {
      World world(quiet_world());
      for (int i = -1; i < 6; ++i)
        for (int j = -12; j <= 12; ++j) {
          BodyDef def = cube_tile(i % 3 == 0 ? MotionType::fixed : MotionType::kinematic, i, j);
          def.velocity.linear.y = i % 3 == 0 ? 0 : i % 3 == 1 ? 1.0f : -1.5f;
          world.add(def);
        }
      const BodyId body = add_slider(world, shapes[k], 0);
      SCOPED_TRACE(name_of(k, speed));
      expect_undisturbed(world, body, {speed, 0, 0}, speed, static_cast<int>(60 * 4 / speed), stay);
    }
}

TEST(MovingSeams, ALiftHoldsWhatComesAgainstItsSide) {
  for (const bool down : {false, true}) {
    World world(quiet_world());
    std::vector<std::pair<BodyId, Vec3>> lifts;
    for (int i = -3; i < 5; ++i)
      for (int j = -2; j <= 2; ++j) {
        // The body is on the part that stays lower.
        const bool is_lift = (i > 1) != down;
        const BodyDef def = cube_tile(is_lift ? MotionType::kinematic : MotionType::fixed, i, j);
        const BodyId id = world.add(def);
        if (is_lift) lifts.emplace_back(id, def.pose.position);
      }
    for (const float apart : {0.05f, 0.2f}) {
      const BodyId body = add_slider(world, box({0.2f, 0.2f, 0.2f}), 1.5f - 0.24f - apart);
      run(world, 10);
      world.set_velocity(body, {2, 0, 0}, {});
      for (int i = 1; i <= 60; ++i) {
        const float z = (down ? -0.5f : 0.5f) * static_cast<float>(i) / 60;
        for (const auto& [id, at] : lifts) world.move_to(id, {.position = at + Vec3{0, 0, z}});
        world.step();
      }
      EXPECT_LT(world.pose(body).position.x, 1.5f) << apart;
      EXPECT_LT(world.velocity(body).linear.x, 0.1f) << apart;
      world.remove(body);
      for (const auto& [id, at] : lifts) world.set_pose(id, {.position = at});
    }
  }
}

TEST(MovingSeams, ALiftThatStopsLevelWithTheFloorJoinsIt) {
  const std::vector<Shape> shapes = sliders();
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    World world(quiet_world());
    std::vector<std::pair<BodyId, Vec3>> lifts;
    for (int i = -2; i < 9; ++i)
      for (int j = -2; j <= 2; ++j) {
        const BodyDef def = cube_tile(i < 2 ? MotionType::kinematic : MotionType::fixed, i, j);
        const BodyId id = world.add(def);
        if (i < 2) lifts.emplace_back(id, def.pose.position);
      }
    const BodyId body = add_slider(world, shapes[k], 0);
    run(world, 30);
    const float height = world.pose(body).position.z;
    const auto ride = [&](float z) {
      for (const auto& [id, at] : lifts) world.move_to(id, {.position = at + Vec3{0, 0, z}});
      world.step();
    };
    for (int i = 1; i <= 30; ++i) ride(-0.01f * static_cast<float>(i));
    for (int i = 29; i >= 0; --i) ride(-0.01f * static_cast<float>(i));
    run(world, 30);
    EXPECT_NEAR(world.pose(body).position.z, height, 1e-3f);
    SCOPED_TRACE(name_of(k, 2));
    expect_undisturbed(world, body, {2, 0, 0}, 2, 150, stay);
  }
}

// Without gravity, along a wall of boxes that move together.
TEST(MovingSeams, NothingCatchesOnAWallThatMoves) {
  for (const Shape& shape : {box({0.2f, 0.2f, 0.2f}), sphere(0.2f)}) {
    World world(quiet_world());
    world.set_gravity({0, 4, 0});
    for (int i = -1; i < 12; ++i)
      for (int k = -2; k <= 2; ++k) {
        BodyDef def = tile(i % 3 == 0 ? MotionType::fixed : MotionType::kinematic, box({half, 0.1f, half}),
                           {2 * half * static_cast<float>(i), 0.1f, 2 * half * static_cast<float>(k)});
        if (i % 3 != 0) def.velocity.linear.z = i % 3 == 1 ? 0.3f : -0.2f;
        world.add(def);
      }
    BodyDef def = dynamic(shape, {0, -0.2f, 0.17f});
    def.material.friction = 0;
    def.velocity.linear = {3, 0, 0.1f};
    const BodyId body = world.add(def);
    for (int i = 0; i < 180; ++i) {
      world.step();
      ASSERT_NEAR(world.pose(body).position.y, -0.2f, 1e-3f) << i;
    }
    EXPECT_LT(length(world.velocity(body).linear - def.velocity.linear), 3e-3f);
  }
}

TEST(MovingSeams, WhatDoesNotHoldABodyHidesNothingFromIt) {
  World world(quiet_world());
  world.add(tile(MotionType::fixed, box({10, 10, 0.5f}), {0, 0, -0.5f}));
  world.add(tile(MotionType::kinematic, box({1, 1, 0.2f}), {3, 0, 0.2f}));
  BodyDef ghost = tile(MotionType::kinematic, box({1, 1, 0.2f}), {1, 0, 0.2f});
  ghost.filter.category = 2;
  world.add(ghost);
  BodyDef def = dynamic(box({0.15f, 0.15f, 0.15f}), {0, 0, 0.15f});
  def.material.friction = 0;
  def.velocity.linear.x = 1.5f;
  def.filter.mask = 1;
  const BodyId body = world.add(def);
  run(world, 120);
  EXPECT_NEAR(world.pose(body).position.x, 1.85f, 0.2f);
  EXPECT_LT(world.velocity(body).linear.x, 0.01f);
}

TEST(MovingSeams, GoOnAlikeFromASnapshotAndOnMoreThreads) {
  const auto make = [](int threads) {
    World world(quiet_world(threads));
    for (int i = -1; i < 8; ++i)
      for (int j = -3; j <= 3; ++j) {
        BodyDef def = cube_tile((i + j) % 3 == 0 ? MotionType::fixed : MotionType::kinematic, i, j);
        if ((i + j) % 3 == 1) def.velocity.angular.z = 0.2f;
        if ((i + j) % 3 == 2) def.velocity.linear.z = i % 2 == 0 ? 0.01f : -0.05f;
        world.add(def);
      }
    Generator random(1);
    for (int i = 0; i < 40; ++i) {
      const Shape shapes[] = {box({0.1f, 0.1f, 0.1f}), sphere(0.1f), capsule(0.05f, 0.05f), cylinder(0.1f, 0.1f)};
      BodyDef def = dynamic(shapes[i % 4], {uniform(random, 0, 4), uniform(random, -2, 2), 0.15f});
      def.velocity.linear = {uniform(random, -3, 3), uniform(random, -3, 3), 0};
      def.material.friction = 0.1f;
      world.add(def);
    }
    return world;
  };
  EXPECT_TRUE(goes_on_alike(make));
}

}  // namespace
}  // namespace fathom::test::moving_seam_test
