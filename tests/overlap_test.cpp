// Bodies that start overlapping: they carry each other at once and separate without a jump.
#include "dynamics/overlap.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <fathom/world.hpp>
#include <vector>

#include "world_fixture.hpp"

namespace fathom::test::overlap_test {
namespace {

/// Three bodies on the ground, each `depth` (m) inside the one below.
std::vector<BodyId> sunk_stack(World& world, const Shape& shape, float depth) {
  world.add(ground());
  std::vector<BodyId> ids;
  for (int i = 0; i < 3; ++i)
    ids.push_back(world.add(dynamic(shape, {0, 0, 1.0f + static_cast<float>(i) - static_cast<float>(i + 1) * depth})));
  return ids;
}

/// N, over all contacts with fixed bodies, in the last step.
float force_on_the_ground(const World& world) {
  float impulse = 0;
  world.for_each_contact([&](const ContactInfo& c) {
    if (world.motion(c.a) != MotionType::fixed) return;
    for (int p = 0; p < c.point_count; ++p) impulse += c.points[p].impulse;
  });
  return impulse / world.definition().dt;
}

}  // namespace

// If pushed out at once, the topmost of three bodies would hop by 29.6 mm at 60 Hz for overlaps of 1 cm, by half a
// metre for 4.9 cm.
TEST(Overlap, StacksRiseWithoutAHop) {
  for (const float dt : {1.0f / 60, 1.0f / 240, 1.0f / 1000})
    for (const Shape& shape : {box({0.5f, 0.5f, 0.5f}), sphere(0.5f)})
      for (const float depth : {0.0001f, 0.001f, 0.01f, 0.049f}) {
        WorldDef def = quiet_world();
        def.dt = dt;
        World world(def);
        const BodyId top = sunk_stack(world, shape, depth).back();
        const float start = world.pose(top).position.z;
        float fastest = 0;
        for (int i = 0; i < static_cast<int>(1.5f / dt); ++i) {
          world.step();
          ASSERT_LT(world.pose(top).position.z, 3.0f) << depth << " m deep, Δt " << dt << ", step " << i;
          ASSERT_GT(world.pose(top).position.z, start - 0.006f) << depth << " m deep, Δt " << dt << ", step " << i;
          fastest = max(fastest, world.velocity(top).linear.z);
        }
        // The topmost rises as the overlaps of all three contacts fade, which stiff contacts follow closely.
        EXPECT_LT(fastest, 3 * depth / overlap_time + 1e-3f) << depth << " m deep, Δt " << dt;
        EXPECT_GT(world.pose(top).position.z, 2.99f) << depth << " m deep, Δt " << dt;
      }
}

// If pushed out at once, two of three balls would be in the air for more than 40 steps, and weigh nothing.
TEST(Overlap, CarriesItsLoadAtOnce) {
  WorldDef def = quiet_world();
  def.dt = 0.001f;
  def.solver.contact_hertz = 1000;
  World world(def);
  sunk_stack(world, sphere(0.5f), 0.001f);
  run(world, 5);
  for (int i = 0; i < 200; ++i) {
    world.step();
    ASSERT_NEAR(force_on_the_ground(world), 3 * 9.81f, 0.15f * 3 * 9.81f) << "step " << i;
  }
}

// Pushed out as fast as their springs can, cubes would hop by 0.4 m from a depth of 0.2 m, whatever their size.
TEST(Overlap, WhatBeginsDeepRisesWithoutAHopToo) {
  for (const float size : {0.05f, 0.5f})
    for (const float part : {0.12f, 0.3f, 0.6f, 0.95f}) {
      World world(quiet_world());
      world.add(ground());
      const float depth = part * size;
      const BodyId id = world.add(dynamic(box({size, size, size}), {0, 0, 0.5f + size - depth}));
      float highest = 0, fastest = 0;
      for (int i = 0; i < 90; ++i) {
        world.step();
        highest = max(highest, world.pose(id).position.z), fastest = max(fastest, world.velocity(id).linear.z);
      }
      EXPECT_LT(highest, 0.5f + size + 0.01f * size) << depth << " m deep";
      EXPECT_GT(world.pose(id).position.z, 0.5f + 0.99f * size) << depth << " m deep";
      EXPECT_LT(fastest, 8 * depth) << depth << " m deep";
    }
}

// Cubes placed on a grid that is too narrow for them: each has up to six neighbours to part from at once. Pushed out as
// fast as springs can, they would fly apart with 2.3 to 3.5 J/kg.
TEST(Overlap, GridsOfBodiesInsideEachOtherDoNotExplode) {
  for (const float pitch : {0.6f, 0.75f, 0.9f}) {
    World world(quiet_world());
    world.add(ground());
    std::vector<BodyId> ids;
    for (int i = 0; i < 48; ++i)
      ids.push_back(world.add(dynamic(box({0.2f, 0.2f, 0.2f}), {0.4f * pitch * static_cast<float>(i % 4),
                                                                0.4f * pitch * static_cast<float>(i / 4 % 4),
                                                                0.7f + 0.4f * pitch * static_cast<float>(i / 16)})));
    float energy = 0;  // J/kg, the largest mean
    for (int i = 0; i < 30; ++i) {
      world.step();
      float sum = 0;
      for (const BodyId id : ids) sum += 0.5f * dot(world.velocity(id).linear, world.velocity(id).linear);
      energy = max(energy, sum / static_cast<float>(ids.size()));
    }
    EXPECT_LT(energy, 1) << "pitch " << pitch;
  }
}

// In a crowd a hit throws bouncing bodies into others that no contact expected: they must bounce from there.
TEST(Overlap, WhatBouncesMayBeginDeeper) {
  World world(quiet_world());
  world.add(ground());
  BodyDef def = cube({0, 0, 0.92f});
  def.material.restitution = 0.5f;
  const BodyId id = world.add(def);
  world.step();
  EXPECT_LT(world.velocity(id).linear.z, 0.08f / overlap_time) << "it rises with its overlap, and is not pushed";
  run(world, 3);
  EXPECT_LT(world.pose(id).position.z, 0.96f);
}

// A body that was lifted out lands on the surface, not at its starting depth.
TEST(Overlap, EndsWhereBodiesPart) {
  World world(quiet_world());
  world.add(ground());
  const BodyId id = world.add(cube({0, 0, 0.96f}));
  run(world, 2);
  EXPECT_LT(world.pose(id).position.z, 0.975f);
  world.set_pose(id, {{0, 0, 1.005f}, 0, {}});  // still in contact range
  world.set_velocity(id, {}, {});
  for (int i = 0; i < 60; ++i) {
    world.step();
    ASSERT_GT(world.pose(id).position.z, 0.995f) << "step " << i;
  }
}

TEST(Overlap, GoesOnAfterASnapshot) {
  World world(quiet_world());
  sunk_stack(world, box({0.5f, 0.5f, 0.5f}), 0.02f);
  run(world, 5);
  std::vector<std::byte> bytes;
  world.save(bytes);
  World other(quiet_world());
  other.restore(bytes);
  for (int i = 0; i < 60; ++i) {
    world.step();
    other.step();
    ASSERT_EQ(world.state_hash(), other.state_hash()) << "step " << i;
  }
}

}  // namespace fathom::test::overlap_test
