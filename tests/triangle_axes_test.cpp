// The axes that separate eight triangles from a shape, against exact distances (geometry/separation.hpp).
#include "terrain/triangle_axes.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "dynamics/rotation.hpp"
#include "geometry/separation.hpp"
#include "random.hpp"
#include "shape_fixture.hpp"
#include "terrain/triangles_ahead.hpp"

namespace fathom::triangle_axes_test {
namespace {

using test::Generator;
using test::uniform;

std::vector<Shape> shapes() {
  return {box({0.5f, 0.3f, 0.2f}),          box({1, 1, 0.005f}), test::cylinder_hull(0.4f, 0.3f, 20),
          test::cylinder_hull(0.02f, 1, 6), sphere(0.4f),        capsule(0.2f, 0.5f),
          test::box_hull({0.3f, 0.3f, 2})};
}

/// Around the origin, from thin to wide.
Triangle any_triangle(Generator& random) {
  const Vec3 centre = 1.5f * test::in_cube(random);
  const float size = uniform(random, 0.02f, 2), thin = random() % 4 == 0 ? 0.01f : 1.0f;
  const Vec3 along = size * test::on_sphere(random), across = size * thin * test::on_sphere(random);
  return {{centre, centre + along, centre + uniform(random, 0, 1) * along + across}, {0, 1, 2}};
}

EightTriangles any_triangles(Generator& random, int count) {
  EightTriangles triangles;
  for (int i = 0; i < count; ++i) triangles.add({any_triangle(random), {}});
  return triangles;
}

double distance(const SurfaceTriangle& t, const Geometry& shape, Quat rotation, Vec3 position = {}) {
  Geometry triangle;
  triangle.type = ShapeType::hull;
  triangle.hull.vertices = t.corners;
  triangle.hull.vertex_count = 3;
  return separation(PlacedShape(triangle, {}), PlacedShape(shape, {position, 0, rotation})).distance;
}

/// Of the vertices of a shape's core from its centre.
float reach_of_core(const TurnedShape& shape) {
  if (shape.is_round()) return max(length(shape.round().core.from), length(end_of(shape.round().core)));
  float reach = 0;
  for (int i = 0; i < shape.turned().vertex_count; ++i) reach = max(reach, length(shape.turned().vertices[i]));
  return reach;
}

TriangleAxes axes_of(const EightTriangles& triangles, const TurnedShape& shape, float margin) {
  TriangleAxes axes = face_axes_of(triangles, shape, margin, {});
  add_edge_axes(triangles, shape, margin, axes);
  return axes;
}

bool same_lane(const TriangleAxes& a, int i, const TriangleAxes& b, int j) {
  return a.of_normal[i] == b.of_normal[j] && a.of_face[i] == b.of_face[j] && a.face[i] == b.face[j] &&
         a.edge[i] == b.edge[j] && a.edge_of_shape[i] == b.edge_of_shape[j];
}

TEST(TriangleAxes, KeepEveryTriangleThatIsNearAndFewOthers) {
  Generator random(1);
  int far = 0, kept = 0;
  for (const Shape& shape : shapes()) {
    const Geometry g = geometry(shape);
    for (int run = 0; run < 1500; ++run) {
      const TurnedShape turned(g, test::any_rotation(random));
      const float margin = uniform(random, 0, 0.1f);
      const EightTriangles triangles = any_triangles(random, 1 + static_cast<int>(random() % 8));
      const TriangleAxes axes = axes_of(triangles, turned, margin);
      ASSERT_EQ(axes.near & ~triangles.present(), 0u);
      for (int i = 0; i < triangles.count; ++i) {
        const SurfaceTriangle t = triangles.at(i);
        const bool near = axes.near >> i & 1;
        if (t.offset > 0.5f * turned.inner()) {
          ASSERT_FALSE(near) << "the centre is behind it";
          continue;
        }
        const double d = distance(t, g, turned.rotation()), rounding = 1e-5;
        if (d < to_double(margin) - rounding) {
          ASSERT_TRUE(near) << d << " m is within " << margin << " m";
        }
        if (near && !turned.is_round()) {
          EXPECT_LE(to_double(axes.of_normal[i]), d + rounding);
          EXPECT_LE(to_double(axes.of_face[i]), d + rounding);
        }
        if (d > to_double(margin) + 0.1) ++far, kept += near;
      }
    }
  }
  EXPECT_GT(far, 10000);
  EXPECT_LT(kept, far / 20);
}

TEST(TriangleAxes, ATriangleDoesNotFeelThoseBesideIt) {
  Generator random(2);
  for (const Shape& shape : shapes()) {
    const Geometry g = geometry(shape);
    for (int run = 0; run < 200; ++run) {
      const TurnedShape turned(g, test::any_rotation(random));
      const EightTriangles together = any_triangles(random, 8);
      const TriangleAxes axes = axes_of(together, turned, 0.05f);
      for (int i = 0; i < 8; ++i) {
        EightTriangles alone;
        alone.add(together.at(i));
        const TriangleAxes of_one = axes_of(alone, turned, 0.05f);
        ASSERT_EQ(axes.near >> i & 1, of_one.near);
        if (of_one.near && !turned.is_round()) {
          ASSERT_TRUE(same_lane(axes, i, of_one, 0));
        }
      }
    }
  }
}

TEST(TrianglesAhead, AreAllThatAShapeMeetsOnItsWayAndFewOthers) {
  Generator random(3);
  int passed = 0, kept = 0;
  for (const Shape& shape : shapes()) {
    const Geometry g = geometry(shape);
    for (int run = 0; run < 300; ++run) {
      const TurnedShape turned(g, test::any_rotation(random));
      const Vec3 way = uniform(random, 0, 1) * test::in_cube(random), turn = 0.25f * test::in_cube(random);
      const float skin = uniform(random, 0, 0.1f);
      const EightTriangles triangles = any_triangles(random, 8);
      ShapeOnWay on_way;
      on_way.set(turned, {way, turn, 0.5f * length_squared(turn) * reach_of_core(turned)});
      const unsigned met = met_on_way(triangles, on_way, skin);
      for (int i = 0; i < 8; ++i) {
        double nearest = 1e9;
        for (int at = 0; at <= 16; ++at) {
          const float part = 0.0625f * static_cast<float>(at);
          nearest = std::min(nearest,
                             distance(triangles.at(i), g, fathom::turned(turned.rotation(), part * turn), part * way));
        }
        if (nearest < to_double(skin) - 1e-5) {
          ASSERT_TRUE(met >> i & 1) << "comes as near as " << nearest << " m";
        }
        if (nearest > to_double(skin) + 0.1) ++passed, kept += met >> i & 1;
      }
    }
  }
  EXPECT_GT(passed, 4000);
  EXPECT_LT(kept, passed / 5);
}

TEST(EightTriangles, AreToTheBitWhatEachIsAlone) {
  Generator random(4);
  for (int run = 0; run < 2000; ++run) {
    const Vec3 origin = uniform(random, 0, 1000) * test::in_cube(random);
    std::vector<Triangle> given(1 + random() % 8);
    EightTriangles eight;
    for (Triangle& t : given) {
      t = any_triangle(random);
      for (Vec3& corner : t.corners) corner += origin + test::in_cube(random);
      eight.add(t);
    }
    eight.complete(origin);
    ASSERT_EQ(eight.count, static_cast<int>(given.size()));
    for (int i = 0; i < eight.count; ++i) {
      const SurfaceTriangle seen = eight.at(i), alone(given[static_cast<std::size_t>(i)], origin);
      for (int k = 0; k < 3; ++k) {
        ASSERT_EQ(seen.corners[k], alone.corners[k]);
        ASSERT_EQ(seen.names[k], alone.names[k]);
      }
      ASSERT_EQ(seen.normal, alone.normal);
      ASSERT_EQ(seen.offset, alone.offset);
    }
  }
}

TEST(EightTriangles, NamesWhoHasACorner) {
  EightTriangles triangles;
  for (std::uint32_t k = 0; k < 5; ++k) triangles.add({{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {k, k + 1, 7}}, {}});
  EXPECT_EQ(triangles.having(7), 0b11111u);
  EXPECT_EQ(triangles.having(2), 0b00110u);
  EXPECT_EQ(triangles.having(0), 0b00001u) << "what is missing has no names";
  EXPECT_EQ(triangles.at(3).names[1], 4u);
}

}  // namespace
}  // namespace fathom::triangle_axes_test
