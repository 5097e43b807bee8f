// Convex hulls against oracles that share no code with the builder.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/error.hpp>
#include <fathom/shape.hpp>
#include <functional>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "math/vec3d.hpp"
#include "random.hpp"

namespace fathom::hull_test {
namespace {

using namespace test;
using Cloud = std::vector<Vec3>;
Cloud rotated(Cloud cloud, Quat q) {
  for (Vec3& p : cloud) p = rotate(q, p);
  return cloud;
}
Cloud scaled(Cloud cloud, float s) {
  for (Vec3& p : cloud) p *= s;
  return cloud;
}
Cloud moved(Cloud cloud, Vec3 by) {
  for (Vec3& p : cloud) p += by;
  return cloud;
}

float largest_coordinate(const Cloud& cloud) {
  float most = 0;
  for (const Vec3 p : cloud) most = std::max(most, max_component(abs(p)));
  return most;
}

/// What the documentation promises of a hull, up to the rounding of the cloud's coordinates.
void expect_hull_of(const Hull& hull, const Cloud& cloud) {
  const auto vertices = hull.vertices();
  const auto edges = hull.edges();
  const auto planes = hull.planes();
  const double tolerance = 32 * 0x1p-23 * to_double(largest_coordinate(cloud));

  ASSERT_GE(planes.size(), 4u);
  ASSERT_LE(vertices.size(), 255u);
  ASSERT_LE(planes.size(), 255u);
  ASSERT_LE(edges.size(), 1024u);
  ASSERT_EQ(hull.face_edges().size(), planes.size());
  ASSERT_EQ(vertices.size() + planes.size(), edges.size() / 2 + 2) << "Euler's formula";

  // Half-edges: twins run in opposite directions in different faces; every edge is in exactly one face's loop.
  std::vector<int> degree(vertices.size(), 0);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const Hull::HalfEdge edge = edges[e], twin = edges[e ^ 1u];
    ASSERT_LT(edge.next, edges.size());
    ASSERT_LT(edge.origin, vertices.size());
    ASSERT_EQ(edges[edge.next].origin, twin.origin);
    ASSERT_NE(edge.face, twin.face);
    ++degree[edge.origin];
  }
  for (const int d : degree) ASSERT_GE(d, 3);
  std::set<std::size_t> visited;
  std::set<std::pair<int, int>> neighbours;
  for (std::size_t f = 0; f < planes.size(); ++f) {
    const Vec3d n = to_double(planes[f].normal);
    ASSERT_NEAR(length(n), 1, 1e-6);
    int count = 0;
    for (std::size_t e = hull.face_edges()[f];; e = edges[e].next) {
      ASSERT_EQ(edges[e].face, f);
      ASSERT_TRUE(visited.insert(e).second);
      ASSERT_TRUE(neighbours.insert({edges[e].face, edges[e ^ 1u].face}).second) << "two faces share one edge at most";
      ++count;
      const std::size_t e1 = edges[e].next, e2 = edges[e1].next;
      const Vec3d a = to_double(vertices[edges[e].origin]), b = to_double(vertices[edges[e1].origin]),
                  c = to_double(vertices[edges[e2].origin]);
      ASSERT_NEAR(dot(n, a), to_double(planes[f].offset), tolerance) << "the face is planar";
      ASSERT_GT(dot(cross(b - a, c - a), n), -tolerance * length(c - a)) << "convex and counter-clockwise";
      if (e1 == hull.face_edges()[f]) break;
    }
    ASSERT_GE(count, 3);
    for (const Vec3 p : cloud) {
      ASSERT_LE(dot(n, to_double(p) - to_double(hull.offset())), to_double(planes[f].offset) + tolerance);
    }
    ASSERT_GT(planes[f].offset, 0) << "the centre of mass is inside";
  }
  ASSERT_EQ(visited.size(), edges.size());
}

/// A slow hull: six times the volume, summed over all triples of points with no point above their plane. Correct for
/// clouds in general position, where all faces are triangles.
double slow_volume(const Cloud& cloud) {
  const Vec3d origin = to_double(cloud[0]);
  double six_volumes = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    for (std::size_t j = 0; j < cloud.size(); ++j) {
      for (std::size_t k = 0; k < cloud.size(); ++k) {
        if (i >= j || i >= k || j == k) continue;
        const Vec3d a = to_double(cloud[i]) - origin, b = to_double(cloud[j]) - origin,
                    c = to_double(cloud[k]) - origin;
        const Vec3d n = cross(b - a, c - a);
        const bool face = std::all_of(cloud.begin(), cloud.end(), [&](Vec3 p) {
          return p == cloud[i] || p == cloud[j] || p == cloud[k] || dot(n, to_double(p) - origin - a) < 0;
        });
        if (face) six_volumes += dot(a, cross(b, c));
      }
    }
  }
  return six_volumes / 6;
}

Cloud cube_corners() {
  Cloud cloud;
  for (const float x : {-1.f, 1.f})
    for (const float y : {-1.f, 1.f})
      for (const float z : {-1.f, 1.f}) cloud.push_back({x, y, z});
  return cloud;
}
Cloud grid(int n) {
  Cloud cloud;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k) {
        cloud.push_back({static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)});
      }
  return cloud;
}
Cloud prism(int sides, float height) {
  Cloud cloud;
  for (int i = 0; i < sides; ++i) {
    const float angle = 2 * pi * static_cast<float>(i) / static_cast<float>(sides);
    for (const float z : {0.f, height}) cloud.push_back({std::cos(angle), std::sin(angle), z});
  }
  return cloud;
}
Cloud many(int count, const std::function<Vec3()>& point) {
  Cloud cloud;
  for (int i = 0; i < count; ++i) cloud.push_back(point());
  return cloud;
}

void expect_counts(const Hull& hull, std::size_t vertices, std::size_t edges, std::size_t faces) {
  EXPECT_EQ(hull.vertices().size(), vertices);
  EXPECT_EQ(hull.edges().size(), 2 * edges);
  EXPECT_EQ(hull.planes().size(), faces);
}

TEST(Hull, TetrahedronOfUnitAxes) {
  const Cloud cloud{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Shape shape = hull(cloud);
  expect_hull_of(*shape.hull, cloud);
  expect_counts(*shape.hull, 4, 6, 4);
  EXPECT_FLOAT_EQ(shape.hull->volume(), 1.0f / 6);
  EXPECT_LT(distance(shape.hull->offset(), {0.25f, 0.25f, 0.25f}), 1e-7f);
  EXPECT_FLOAT_EQ(shape.hull->inner_radius(), 0.25f / std::sqrt(3.0f));
  EXPECT_FLOAT_EQ(shape.hull->outer_radius(), std::sqrt(0.75f * 0.75f + 2 * 0.0625f));
}

TEST(Hull, CubeHasSixQuadsWhateverLiesOnItsFaces) {
  Generator random(1);
  Cloud cloud = cube_corners();
  for (int i = 0; i < 300; ++i) {
    Vec3 p = in_cube(random);
    (i % 3 == 0 ? p.x : i % 3 == 1 ? p.y : p.z) = i % 2 ? 1.f : -1.f;
    if (i % 5 == 0) (i % 3 == 0 ? p.y : i % 3 == 1 ? p.z : p.x) = 1;  // some on edges
    cloud.push_back(p);
  }
  for (int trial = 0; trial < 200; ++trial) {
    std::shuffle(cloud.begin(), cloud.end(), random);
    Cloud placed = trial == 0 ? cloud : rotated(cloud, any_rotation(random));
    if (trial % 2) placed = moved(scaled(placed, uniform(random, 0.001f, 1000)), 10.f * in_cube(random));
    const Shape shape = hull(placed);
    SCOPED_TRACE("trial " + std::to_string(trial));
    expect_hull_of(*shape.hull, placed);
    expect_counts(*shape.hull, 8, 12, 6);
  }
}

TEST(Hull, GridsAreCubes) {
  for (int n = 2; n <= 12; ++n) {
    const Cloud cloud = grid(n);
    const Shape shape = hull(cloud);
    expect_hull_of(*shape.hull, cloud);
    expect_counts(*shape.hull, 8, 12, 6);
    EXPECT_FLOAT_EQ(shape.hull->volume(), static_cast<float>((n - 1) * (n - 1) * (n - 1)));
  }
}

TEST(Hull, PrismsHaveTwoPolygonsAndQuads) {
  Generator random(2);
  for (std::size_t n = 3; n <= 100; ++n) {
    const Cloud cloud = rotated(prism(static_cast<int>(n), 0.5f), any_rotation(random));
    const Shape shape = hull(cloud);
    SCOPED_TRACE("sides " + std::to_string(n));
    expect_hull_of(*shape.hull, cloud);
    expect_counts(*shape.hull, 2 * n, 3 * n, n + 2);
  }
}

TEST(Hull, PlatonicSolids) {
  const float g = (1 + std::sqrt(5.0f)) / 2;
  Cloud octahedron, icosahedron, dodecahedron = cube_corners();
  for (const float s : {-1.f, 1.f}) {
    octahedron.insert(octahedron.end(), {{s, 0, 0}, {0, s, 0}, {0, 0, s}});
    for (const float t : {-1.f, 1.f}) {
      icosahedron.insert(icosahedron.end(), {{0, s, t * g}, {s, t * g, 0}, {t * g, 0, s}});
      dodecahedron.insert(dodecahedron.end(), {{0, s / g, t * g}, {s / g, t * g, 0}, {t * g, 0, s / g}});
    }
  }
  Generator random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const Quat q = any_rotation(random);
    expect_counts(*hull(rotated(octahedron, q)).hull, 6, 12, 8);
    expect_counts(*hull(rotated(icosahedron, q)).hull, 12, 30, 20);
    expect_counts(*hull(rotated(dodecahedron, q)).hull, 20, 30, 12);
  }
}

TEST(Hull, ThousandsOfRandomClouds) {
  Generator random(4);
  for (int trial = 0; trial < 4000; ++trial) {
    const int count = 4 + static_cast<int>(random() % 60);
    Cloud cloud =
        trial % 2 ? many(count, [&] { return in_cube(random); }) : many(count, [&] { return on_sphere(random); });
    cloud = scaled(cloud, std::pow(10.0f, uniform(random, -3, 3)));
    if (trial % 3 == 0) cloud.insert(cloud.end(), cloud.begin(), cloud.end());  // every point twice
    const Shape shape = hull(cloud);
    expect_hull_of(*shape.hull, cloud);
    if (HasFatalFailure()) FAIL() << "trial " << trial;
  }
}

TEST(Hull, NastyClouds) {
  Generator random(5);
  int refused = 0;
  for (int trial = 0; trial < 6000; ++trial) {
    const int count = 4 + static_cast<int>(random() % 60);
    const float small = std::pow(10.0f, uniform(random, -7, 0));
    Cloud cloud = many(count, [&]() -> Vec3 {
      const Vec3 v = in_cube(random);
      const auto rounded = [](float a) { return std::round(3 * a); };
      switch (trial % 8) {
        case 0:
          return {v.x, v.y, small * v.z};  // plate
        case 1:
          return {v.x, small * v.y, small * v.z};  // needle
        case 2:
          return {rounded(v.x), rounded(v.y), rounded(v.z)};  // few distinct coordinates
        case 3:
          return {v.x < 0 ? -1 + small * v.x : 1 + small * v.x, v.y, v.z};  // two nearly flat ends
        case 4:
          return {v.x, v.y, small * (v.x * v.x + v.y * v.y)};  // flat bowl
        case 5: {                                              // points of a cylinder's rims
          const float angle = pi * v.x;
          return {std::cos(angle), std::sin(angle), v.z < 0 ? -1.f : 1.f};
        }
        case 6:
          return normalize(Vec3{rounded(v.x), rounded(v.y), rounded(v.z)});  // cocircular points of a sphere
        default:
          return {rounded(v.x) + small * v.y, rounded(v.y), rounded(v.z) + small * v.x};  // noisy grid
      }
    });
    if (trial / 8 % 2 == 1) cloud = rotated(cloud, any_rotation(random));
    if (trial % 5 == 0) cloud = moved(cloud, 100.f * in_cube(random));
    cloud = scaled(cloud, std::pow(10.0f, uniform(random, -3, 3)));
    try {
      expect_hull_of(*hull(cloud).hull, cloud);
    } catch (const Error& error) {
      ASSERT_EQ(error.code(), ErrorCode::degenerate_shape);
      ASSERT_THAT(error.what(),
                  testing::AnyOf(testing::HasSubstr("coplanar within"), testing::HasSubstr("collinear within"),
                                 testing::HasSubstr("coincide within"), testing::HasSubstr("too small")))
          << "trial " << trial;
      ++refused;
    }
    if (HasFatalFailure()) FAIL() << "trial " << trial;
  }
  EXPECT_LT(refused, 2500);
}

TEST(Hull, VolumeMatchesASlowHull) {
  Generator random(6);
  for (int trial = 0; trial < 500; ++trial) {
    const Cloud cloud = many(4 + static_cast<int>(random() % 16), [&] { return in_cube(random); });
    const double expected = slow_volume(cloud);
    EXPECT_NEAR(to_double(hull(cloud).hull->volume()), expected, 2e-6 + 1e-5 * expected);
  }
}

TEST(Hull, CentreOfMassIsTheOrigin) {
  Generator random(7);
  for (int trial = 0; trial < 200; ++trial) {
    const Cloud cloud = many(20, [&] { return in_cube(random) + Vec3{5, 6, 7}; });
    const Shape first = hull(cloud);
    const Shape again = hull(first.hull->vertices());
    EXPECT_LT(length(again.hull->offset()), 1e-5f);
    EXPECT_NEAR(again.hull->volume(), first.hull->volume(), 1e-5f);
  }
}

TEST(Hull, EqualCloudsGiveEqualHulls) {
  Generator random(8);
  const Cloud cloud = many(100, [&] { return on_sphere(random); });
  const Shape a = hull(cloud), b = hull(cloud);
  ASSERT_EQ(a.hull->vertices().size(), b.hull->vertices().size());
  EXPECT_TRUE(std::equal(a.hull->vertices().begin(), a.hull->vertices().end(), b.hull->vertices().begin()));
}

TEST(Hull, LargeCloudsOfFewCorners) {
  Generator random(9);
  Cloud cloud = many(20000, [&] { return in_cube(random); });
  for (const Vec3 p : cube_corners()) cloud.push_back(p);
  cloud = rotated(cloud, any_rotation(random));
  const Shape shape = hull(cloud);
  expect_hull_of(*shape.hull, cloud);
  expect_counts(*shape.hull, 8, 12, 6);
}

void expect_refused(const Cloud& cloud, ErrorCode code, const std::string& text) {
  try {
    hull(cloud);
    ADD_FAILURE() << "expected: " << text;
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code);
    EXPECT_THAT(error.what(), testing::HasSubstr("fathom::hull"));
    EXPECT_THAT(error.what(), testing::HasSubstr(text));
  }
}

TEST(Hull, RefusesCloudsWithoutVolume) {
  constexpr auto degenerate = ErrorCode::degenerate_shape;
  Generator random(10);
  expect_refused({}, degenerate, "0 points span no volume");
  expect_refused({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, degenerate, "3 points span no volume");
  expect_refused(Cloud(7, Vec3{1, 2, 3}), degenerate, "7 points coincide");
  for (int trial = 0; trial < 100; ++trial) {
    const Quat q = any_rotation(random);
    const Vec3 offset = in_cube(random);
    expect_refused(moved(rotated(many(9,
                                      [&] {
                                        return Vec3{uniform(random, -1, 1), 0, 0};
                                      }),
                                 q),
                         offset),
                   degenerate, "9 points are collinear");
    expect_refused(moved(rotated(many(9,
                                      [&] {
                                        return Vec3{uniform(random, -1, 1), uniform(random, -1, 1), 0};
                                      }),
                                 q),
                         offset),
                   degenerate, "9 points are coplanar");
  }
  expect_refused(moved(scaled(cube_corners(), 1e-5f), {100, 0, 0}), degenerate, "coincide within");
}

TEST(Hull, RefusesPointsThatAreNotFinite) {
  Cloud cloud = cube_corners();
  cloud[3].y = std::numeric_limits<float>::quiet_NaN();
  expect_refused(cloud, ErrorCode::invalid_argument, "point 3 is not finite");
  cloud[3].y = std::numeric_limits<float>::infinity();
  expect_refused(cloud, ErrorCode::invalid_argument, "point 3 is not finite");
}

TEST(Hull, RefusesMoreThanItCanHold) {
  Generator random(11);
  expect_refused(many(255, [&] { return on_sphere(random); }), ErrorCode::degenerate_shape, "255 vertices");
  expect_refused(many(5000, [&] { return on_sphere(random); }), ErrorCode::degenerate_shape, "more than 255 vertices");
  expect_refused(prism(254, 1), ErrorCode::degenerate_shape, "faces");
  EXPECT_NO_THROW(hull(prism(127, 1)));
}

}  // namespace
}  // namespace fathom::hull_test
