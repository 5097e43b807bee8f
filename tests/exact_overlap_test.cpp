// The validation suite's own measure of overlap, against depths that are known or found by trying directions.
#include "validate/exact_overlap.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "scene/random.hpp"
#include "scene/scene_parts.hpp"
#include "shape_fixture.hpp"

namespace fathom::validate::exact_overlap_test {
namespace {

using test::box_hull;

Pose at(Vec3 position, Quat rotation = {}) { return {position, 0, rotation}; }

/// The same in both orders.
double depth(const Shape& a, const Pose& pa, const Shape& b, const Pose& pb) {
  const double there = overlap_depth({a, pa}, {b, pb}), back = overlap_depth({b, pb}, {a, pa});
  EXPECT_NEAR(there, back, 1e-12 * (1 + there));
  return there;
}

Quat about_z(double angle) {
  return {static_cast<float>(std::cos(angle / 2)), 0, 0, static_cast<float>(std::sin(angle / 2))};
}

TEST(ExactOverlap, RoundShapes) {
  const Shape ball = sphere(1), pill = capsule(0.5f, 2);
  EXPECT_NEAR(depth(ball, at({}), ball, at({1.5f, 0, 0})), 0.5, 1e-12);
  EXPECT_EQ(depth(ball, at({}), ball, at({2.5f, 0, 0})), 0);
  EXPECT_NEAR(depth(ball, at({}), pill, at({1.25f, 0, 1})), 0.25, 1e-12);  // beside the segment
  EXPECT_NEAR(depth(ball, at({}), pill, at({0, 0, 3.25f})), 0.25, 1e-12);  // at its end
  EXPECT_NEAR(depth(pill, at({}), pill, at({0.75f, 0, 3})), 0.25, 1e-12);  // parallel
  const Quat lying{std::sqrt(0.5f), std::sqrt(0.5f), 0, 0};
  EXPECT_NEAR(depth(pill, at({}), pill, at({0.75f, 0.5f, 1}, lying)), 0.25, 1e-7);  // crossed
}

TEST(ExactOverlap, RoundShapesAndPolyhedra) {
  for (const Shape& block : {box({1, 2, 3}), box_hull({1, 2, 3})}) {
    EXPECT_NEAR(depth(block, at({}), sphere(0.5f), at({1.25f, 0, 0})), 0.25, 1e-12);  // on a face
    EXPECT_NEAR(depth(block, at({}), sphere(0.5f), at({1.3f, 2.4f, 0})), 0, 1e-7);    // at an edge
    EXPECT_NEAR(depth(block, at({}), sphere(1), at({1.3f, 2.4f, 0})), 0.5, 1e-6);
    EXPECT_NEAR(depth(block, at({}), sphere(0.5f), at({0.75f, 0, 0})), 0.75, 1e-12);      // centre inside
    EXPECT_NEAR(depth(block, at({}), capsule(0.5f, 2), at({1.25f, 0, 1})), 0.25, 1e-12);  // along a face
    EXPECT_NEAR(depth(block, at({}), capsule(0.5f, 9), at({0.75f, 0, 0})), 0.75, 1e-12);  // through it
    const Quat lying{std::sqrt(0.5f), std::sqrt(0.5f), 0, 0};                             // along y
    EXPECT_NEAR(depth(block, at({}), capsule(0.5f, 9), at({1.3f, 0, 3.3f}, lying)), 0.5 - std::sqrt(0.18), 1e-6);
  }
}

TEST(ExactOverlap, Polyhedra) {
  for (const Shape& block : {box({1, 1, 1}), box_hull({1, 1, 1})}) {
    EXPECT_NEAR(depth(block, at({}), block, at({0.5f, 0.25f, 1.9f})), 0.1, 1e-7);
    EXPECT_EQ(depth(block, at({}), block, at({0.5f, 0.25f, 2.1f})), 0);
    EXPECT_NEAR(depth(block, at({}), block, at({})), 2, 1e-12);
    // A rotated one's edge reaches 0.1 into the other's face.
    const float reach = std::sqrt(2.0f);
    EXPECT_NEAR(depth(block, at({}), block, at({reach + 0.9f, 0, 0}, about_z(0.7853981633974483))), 0.1, 1e-6);
  }
  // Edge on edge, crossed: an edge along y and one along x touch at the top.
  const float reach = std::sqrt(2.0f);
  const Quat about_y{std::cos(0.39269908f), 0, std::sin(0.39269908f), 0};
  const Quat about_x{std::cos(0.39269908f), std::sin(0.39269908f), 0, 0};
  EXPECT_NEAR(depth(box({1, 3, 1}), at({}, about_y), box({3, 1, 1}), at({0, 0, 2 * reach - 0.1f}, about_x)), 0.1, 1e-6);
}

double reach(const Solid& solid, Vec3d direction) {
  double most = -1e300;
  for (const Vec3d& p : solid.corners) most = std::max(most, dot(p, direction));
  return most + solid.radius;
}

// No direction separates the shapes by less than the depth, and some of many need little more.
TEST(ExactOverlap, NoDirectionOverlapsLess) {
  Random random(3);
  const auto unit = [&] {
    for (;;) {
      const double x = random.symmetric(1), y = random.symmetric(1), z = random.symmetric(1);
      const double square = x * x + y * y + z * z;
      if (square < 1 && square > 0.01) return 1 / std::sqrt(square) * Vec3d{x, y, z};
    }
  };
  const auto random_hull = [&] {
    std::vector<Vec3> points;
    for (int i = 0; i < 12; ++i) points.push_back(to_float(0.8 * unit()));
    return hull(points);
  };
  int overlapping = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const Shape shapes[] = {sphere(0.6f), capsule(0.3f, 0.7f), box({0.4f, 0.7f, 0.5f}), random_hull()};
    const Solid a(shapes[trial % 4], at({}, random_rotation(random)));
    const Solid b(shapes[trial / 4 % 4], at(to_float(0.9 * unit()), random_rotation(random)));
    const double depth = overlap_depth(a, b);
    double least = 1e300;
    for (int i = 0; i < 20000; ++i) {
      const Vec3d n = unit();
      least = std::min(least, reach(a, n) + reach(b, -1.0 * n));
    }
    if (depth <= 0) continue;
    ++overlapping;
    EXPECT_LE(depth, least + 1e-9) << trial;
    EXPECT_GE(depth, least - 0.03) << trial;
  }
  EXPECT_GT(overlapping, 30);
}

}  // namespace
}  // namespace fathom::validate::exact_overlap_test
