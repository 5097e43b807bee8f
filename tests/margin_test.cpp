// Margins follow the size of bodies: small ones have few neighbours, and are still stopped where they land.
#include <gtest/gtest.h>

#include <algorithm>
#include <fathom/world.hpp>

#include "dynamics/bounds.hpp"

namespace fathom::test::margin_test {
namespace {

WorldDef on_one_thread() {
  WorldDef def;
  def.threads = 1;
  def.sleep.enabled = false;
  return def;
}

void add_floor(World& world, float size) {
  BodyDef floor;
  floor.motion = MotionType::fixed;
  floor.shape = box({100 * size, 100 * size, size});
  floor.pose.position = {0, 0, -size};
  world.add(floor);
}

TEST(Margin, EverydayBodiesHaveOneCentimetre) {
  for (const float radius : {0.2f, 0.866f, 50.0f}) EXPECT_EQ(half_speculative_margin(radius, 1.0f / 60), 0.01f);
  EXPECT_LT(half_speculative_margin(0.005f, 1.0f / 60), 0.002f);
  EXPECT_LT(half_speculative_margin(0.005f, 1.0f / 240), 0.0004f);
}

/// Manifolds of 5 × 5 columns of 5 cubes, a quarter of an edge length apart.
double manifolds_per_body(float edge, float dt) {
  WorldDef def = on_one_thread();
  def.dt = dt;
  World world(def);
  add_floor(world, edge);
  for (int i = 0; i < 125; ++i) {
    BodyDef body;
    body.shape = box({edge / 2, edge / 2, edge / 2});
    const auto at = [](int k) { return static_cast<float>(k % 5); };
    body.pose.position = edge * Vec3{1.25f * at(i), 1.25f * at(i / 5), at(i / 25) + 0.5f};
    world.add(body);
  }
  for (int i = 0; i < 120; ++i) world.step();
  return world.profile().counts.manifolds / 125.0;
}

TEST(Margin, PebblesTouchNoMoreThanBoulders) {
  const double boulders = manifolds_per_body(1, 1.0f / 60);
  EXPECT_NEAR(manifolds_per_body(0.05f, 1.0f / 60), boulders, 0.1);
  EXPECT_NEAR(manifolds_per_body(0.005f, 1.0f / 240), boulders, 0.1);
  EXPECT_LT(manifolds_per_body(0.005f, 1.0f / 60), 10);  // a step's fall, 2.7 mm, is half their size
}

TEST(Margin, WhateverFallsIsStoppedAtTheFloor) {
  for (const float size : {0.005f, 0.02f, 0.1f, 1.0f}) {
    for (const float height : {0.01f, 0.1f, 0.5f, 1.0f, 10.0f}) {  // relative to its size
      for (const Shape& shape : {box({size / 2, size / 2, size / 2}), sphere(size / 2), capsule(size / 4, size / 4)}) {
        World world(on_one_thread());
        add_floor(world, size);
        BodyDef body;
        body.shape = shape;
        body.pose.position = {0, 0, size * (0.5f + height)};
        const BodyId id = world.add(body);
        float lowest = 0;
        for (int i = 0; i < 60; ++i) {
          world.step();
          lowest = std::min(lowest, world.bounds(id).lower.z);
        }
        EXPECT_GT(lowest, -0.05f * size) << "size " << size << " m, from " << height << " sizes above";
      }
    }
  }
}

}  // namespace
}  // namespace fathom::test::margin_test
