// Shapes as bytes (fathom/saved_shape.hpp).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fathom/compound.hpp>
#include <fathom/error.hpp>
#include <fathom/mesh.hpp>
#include <fathom/saved_shape.hpp>

#include "random.hpp"
#include "test_surfaces.hpp"
#include "world/sealed_bytes.hpp"
#include "world_fixture.hpp"

namespace fathom::test::saved_shape_test {
namespace {

using testing::HasSubstr;

Shape loaded(const Shape& shape) {
  std::vector<std::byte> bytes;
  save_shape(shape, bytes);
  return load_shape(bytes);
}

std::vector<Shape> convex_shapes() {
  const std::vector<ChildShape> children{{.shape = box({0.3f, 0.2f, 0.1f}), .material = Material{.friction = 0.1f}},
                                         {.shape = cylinder(0.1f, 0.3f), .pose = {.position = {0.2f, 0, 0.3f}}}};
  return {sphere(0.3f), capsule(0.2f, 0.4f), box({0.3f, 0.2f, 0.1f}), cone(0.3f, 0.5f), compound(children)};
}

/// All shapes fall on the ground.
std::uint64_t hash_of_heap(const Shape& ground, const std::vector<Shape>& shapes) {
  World world(quiet_world());
  world.add(fixed(ground));
  Generator random(5);
  for (int i = 0; i < 40; ++i) {
    const Vec3 at{uniform(random, -2, 2), uniform(random, -2, 2), uniform(random, 1, 5)};
    world.add(dynamic(shapes[static_cast<std::size_t>(i) % shapes.size()], at));
  }
  run(world, 150);
  return world.state_hash();
}

TEST(SavedShape, MovesAsTheOriginal) {
  const std::vector<Shape> shapes = convex_shapes();
  std::vector<Shape> copies;
  for (const Shape& shape : shapes) copies.push_back(loaded(shape));
  for (const Shape& ground : {wavy_mesh(), flat_mesh(3, 5), wavy_field()})
    EXPECT_EQ(hash_of_heap(ground, shapes), hash_of_heap(loaded(ground), copies));
}

std::string refusal(std::span<const std::byte> bytes) {
  try {
    load_shape(bytes);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::file);
    return error.what();
  }
  return "";
}

TEST(SavedShape, OtherBytesAreRefused) {
  std::vector<std::byte> bytes;
  save_shape(wavy_mesh(3), bytes);
  EXPECT_EQ(refusal(bytes), "");
  for (std::size_t size = 0; size < bytes.size(); size += 7) EXPECT_NE(refusal(std::span(bytes).first(size)), "");
  std::vector<std::byte> altered = bytes;
  altered[100] ^= std::byte{1};
  EXPECT_THAT(refusal(altered), HasSubstr("shape: its checksum does not match its content; it was altered"));
  altered = bytes;
  altered[8] = std::byte{77};
  EXPECT_THAT(refusal(altered), HasSubstr("it has format version 77, this build reads version 3"));
  EXPECT_THAT(refusal(saved(World())), HasSubstr("shape: this is no saved shape"));
  EXPECT_THROW(save_shape(sphere(-1), bytes), Error);
}

/// Whether walks around all faces and vertices come back after as many edges as there are at most.
bool walks_end(const Hull& hull) {
  const auto edges = hull.edges();
  const auto ends = [&](std::size_t from, const auto& next) {
    std::size_t edge = from;
    for (std::size_t steps = 0; steps < edges.size(); ++steps)
      if ((edge = next(edge)) == from) return true;
    return false;
  };
  bool all = true;
  for (const std::uint16_t edge : hull.face_edges()) all &= ends(edge, [&](std::size_t e) { return edges[e].next; });
  for (const std::uint16_t edge : hull.vertex_edges())
    all &= ends(edge, [&](std::size_t e) { return edges[e ^ 1].next; });
  return all;
}

// The checksum is right: somebody meant it.
TEST(SavedShape, HullsWhoseEdgesLeadAstrayAreRefused) {
  std::vector<std::byte> good;
  save_shape(cylinder(0.3f, 0.5f, 7), good);
  int refused = 0;
  for (std::size_t at = 32; at < good.size(); ++at) {
    for (const int flipped : {1, 6, 128}) {
      std::vector<std::byte> bytes = good;
      bytes[at] ^= static_cast<std::byte>(flipped);
      seal(bytes);
      try {
        EXPECT_TRUE(walks_end(*load_shape(bytes).hull)) << at;
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::file);
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 300);
}

TEST(SavedShape, SizesThatNoShapeCouldHaveAreRefused) {
  for (Shape shape : {sphere(0.3f), capsule(0.2f, 0.4f), box({0.3f, 0.2f, 0.1f})}) {
    std::vector<std::byte> good;
    save_shape(shape, good);
    for (const float size : {-1.0f, 0.0f, std::nanf("")}) {
      std::vector<std::byte> bytes = good;
      // After the type: the radius, then half extents.
      std::memcpy(bytes.data() + 33 + (shape.type == ShapeType::box ? 4 : 0), &size, sizeof size);
      seal(bytes);
      EXPECT_THAT(refusal(bytes), HasSubstr("it must be finite"));
    }
  }
}

}  // namespace
}  // namespace fathom::test::saved_shape_test
