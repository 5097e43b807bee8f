// Contacts with bumpy meshes against distances in double precision: none is missing, and none reaches through a peak.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/mesh.hpp>
#include <vector>

#include "geometry/separation.hpp"
#include "terrain/surface_contact.hpp"
#include "test_hulls.hpp"

namespace fathom::test::surface_depth_test {
namespace {

/// A shape that touches a mesh, or nearly does, without its core reaching it.
struct Case {
  Shape mesh, shape;
  Pose pose;
  float margin = 0;
  double separation = 0;  ///< m
};

constexpr unsigned cells = 14;

/// Heights are random, up to `steepness` cells apart.
Shape bumpy_mesh(Sampler& random, float cell, float steepness) {
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> indices;
  for (unsigned i = 0; i <= cells; ++i)
    for (unsigned k = 0; k <= cells; ++k)
      vertices.push_back({cell * (static_cast<float>(i) - 7), cell * (static_cast<float>(k) - 7),
                          cell * steepness * random.uniform(-0.5f, 0.5f)});
  for (unsigned i = 0; i < cells; ++i)
    for (unsigned k = 0; k < cells; ++k) {
      const std::uint32_t a = i * (cells + 1) + k, b = a + cells + 1;
      for (const std::uint32_t index : {a, b, b + 1, a, b + 1, a + 1}) indices.push_back(index);
    }
  return mesh(vertices, indices);
}

Shape any_shape(Sampler& random, float size) {
  const auto smaller = [&] { return size * std::exp(random.uniform(-2, 0)); };
  switch (random.integer(5)) {
    case 0:
      return sphere(size);
    case 1:
      return capsule(smaller(), size);
    case 2:
      return rounded(box({smaller(), smaller(), smaller()}), smaller());
    case 3:
      return rounded(cylinder(smaller(), smaller()), smaller());
    default:
      return box({smaller(), smaller(), smaller()});
  }
}

/// Distance (m) of the shape's core from the mesh.
double distance_of_core(const Case& c) {
  Geometry core = geometry(c.shape);
  core.radius = core.hull.radius = 0;
  const float near = bounding_radius(core) + 2 * c.shape.radius + 3;  // twice the largest cell
  double least = 1e30;
  for (std::uint32_t t = 0; t < c.mesh.surface->triangle_count(); ++t) {
    const Triangle triangle = c.mesh.surface->triangle(t);
    if (abs(triangle.corners[0].x - c.pose.position.x) > near || abs(triangle.corners[0].y - c.pose.position.y) > near)
      continue;
    Geometry flat{ShapeType::hull};
    flat.hull.vertices = triangle.corners;
    flat.hull.vertex_count = 3;
    least = std::min(least, separation(PlacedShape(flat, {}), PlacedShape(core, c.pose)).distance);
  }
  return least;
}

/// Lowered from above until it touches by as much as chosen. False if it then has no distance.
bool make_case(unsigned seed, Case& c) {
  Sampler random(seed);
  const float cell = random.uniform(0.5f, 1.5f), steepness = random.uniform(0, 2);
  c.mesh = bumpy_mesh(random, cell, steepness);
  const float size = cell * random.uniform(0.1f, 1);
  c.shape = any_shape(random, size);
  c.pose = {{random.uniform(-2, 2) * cell, random.uniform(-2, 2) * cell, 3 * cell * steepness + 4 * size},
            0,
            random.rotation()};
  c.margin = 0.1f * size;
  const float radius = c.shape.radius;
  const double wanted = to_double(radius > 0 ? random.uniform(0.1f, 1) * radius : random.uniform(0.1f, 1) * c.margin);
  double distance = 0;
  for (int i = 0; i < 60; ++i) {
    distance = distance_of_core(c);
    if (distance - wanted < 1e-5) break;
    c.pose.position.z -= static_cast<float>(0.999 * (distance - wanted));
  }
  c.separation = distance - to_double(radius);
  return distance > 1e-3 && distance - wanted < 1e-3;
}

double nearest_of(const Case& c, const Geometry& shape) {
  SurfaceScratch scratch;
  SurfaceContact contact;
  collide_surface(*c.mesh.surface, shape, c.pose, c.margin, {}, scratch, contact);
  double nearest = 1e30;
  for (int i = 0; i < contact.count; ++i)
    nearest = std::min(nearest, to_double(nearest_separation(contact.manifolds[i])));
  return nearest;
}

void expect_depth(unsigned seed, int& checked) {
  Case c;
  if (!make_case(seed, c)) return;
  ++checked;
  const double nearest = nearest_of(c, geometry(c.shape));
  // Axes are compared to within 2.5 mm; those of polyhedra do not see the distance between corners.
  const double tolerance = 4e-3 + 0.02 * to_double(c.margin);
  EXPECT_GT(nearest, c.separation - tolerance - (c.shape.radius > 0 ? 0 : c.separation)) << seed;
  if (c.shape.radius > 0) {
    EXPECT_LT(nearest, c.separation + tolerance) << seed;
  }
}

TEST(SurfaceDepth, IsThatOfTheShapes) {
  int checked = 0;
  for (unsigned seed = 1; seed <= 3000; ++seed) expect_depth(seed, checked);
  EXPECT_GT(checked, 2000);
}

}  // namespace
}  // namespace fathom::test::surface_depth_test
