// Bodies rest on flat meshes and slide over their seams.
#include <gtest/gtest.h>

#include <algorithm>

#include "geometry/support.hpp"
#include "test_surfaces.hpp"
#include "world_fixture.hpp"

namespace fathom::test::surface_test {
namespace {

struct Slide {
  World world;
  BodyId body;
};

Slide slide_on(const Shape& ground, const Shape& shape, Vec3 position, Vec3 velocity, float friction = 0) {
  WorldDef def = sleepy_world();
  def.sleep.enabled = false;
  World world(def);
  BodyDef floor;
  floor.motion = MotionType::fixed;
  floor.shape = ground;
  floor.material.friction = friction;
  world.add(floor);
  BodyDef body;
  body.shape = shape;
  body.pose.position = position;
  body.velocity.linear = velocity;
  body.material.friction = friction;
  const BodyId id = world.add(body);
  return {std::move(world), id};
}

TEST(Surfaces, RestOnAFlatMesh) {
  for (const float cell : {0.05f, 0.3f, 5.0f})
    for (const Shape& shape : shapes_of(0.5f)) {
      const int cells = std::max(1, static_cast<int>(6 / cell));
      Slide s = slide_on(flat_mesh(cells, 3), shape, {0.13f, 0.21f, 1.5f}, {}, 0.5f);
      for (int i = 0; i < 240; ++i) s.world.step();
      const Pose pose = s.world.pose(s.body);
      const Velocity v = s.world.velocity(s.body);
      EXPECT_LT(length(v.linear), 1e-3f) << "shape " << static_cast<int>(shape.type) << " cell " << cell;
      EXPECT_LT(pose.position.z, 0.8f);
      EXPECT_GT(pose.position.z, 0.2f) << "shape " << static_cast<int>(shape.type) << " cell " << cell;
    }
}

TEST(Surfaces, NothingCatchesOnSeams) {
  for (const float speed : {1.0f, 8.0f, 30.0f})
    for (const Shape& shape : shapes_of(0.3f)) {
      const float z = -bounds(geometry(shape), Pose{}).lower.z;
      Slide s = slide_on(flat_mesh(600, 60), shape, {-55, 0.137f, z}, {});
      // Let it settle first.
      for (int i = 0; i < 120; ++i) s.world.step();
      const float height = s.world.pose(s.body).position.z;
      s.world.set_velocity(s.body, {speed, 0, 0}, {});
      float highest = -1, lowest = 1e9f;
      const int steps = std::min(static_cast<int>(60 * 100 / speed), 1500);
      for (int i = 0; i < steps; ++i) {
        s.world.step();
        highest = std::max(highest, s.world.pose(s.body).position.z);
        lowest = std::min(lowest, s.world.pose(s.body).position.z);
      }
      const Velocity v = s.world.velocity(s.body);
      EXPECT_NEAR(v.linear.x, speed, 0.001f * speed);
      EXPECT_NEAR(highest, height, 0.001f);
      EXPECT_NEAR(lowest, height, 0.001f);
    }
}

}  // namespace
}  // namespace fathom::test::surface_test
