// Distances of shapes, each proved by two points at that distance, and a slab of that width between the shapes.
#include "geometry/separation.hpp"

#include <gtest/gtest.h>

#include <string>

#include "geometry/geometry.hpp"
#include "query_oracle.hpp"

namespace fathom::separation_test {
namespace {

using namespace test;

DVec oracle(Vec3d v) { return {v.x, v.y, v.z}; }

double height_at(const Shape& shape, const Pose& pose, DVec p) {
  return height(shape, turned_back(pose.rotation, p - wide(pose.position)));
}
double reach_along(const Shape& shape, const Pose& pose, DVec n) { return reach(shape, turned_back(pose.rotation, n)); }
double size_of(const Shape& shape) {
  return std::max({reach(shape, {1, 0, 0}), reach(shape, {0, 1, 0}), reach(shape, {0, 0, 1})});
}

/// For convex shapes no other result is correct.
void prove(const Separation& s, const Shape& a, const Pose& at_a, const Shape& b, const Pose& at_b) {
  const double tolerance = 4e-6 * (size_of(a) + size_of(b));  // for hulls' planes, which are in single precision
  const DVec origin = wide(at_a.position), on_a = origin + oracle(s.on_a), on_b = origin + oracle(s.on_b);
  ASSERT_LE(height_at(a, at_a, on_a), tolerance);
  ASSERT_LE(height_at(b, at_b, on_b), tolerance);
  if (s.touch()) {
    ASSERT_EQ(length(on_b - on_a), 0);
    ASSERT_EQ(length(oracle(s.normal)), 0);
    return;
  }
  const DVec n = oracle(s.normal);
  const double exact = 1e-9 * (size_of(a) + size_of(b) + length(wide(at_b.position) - origin));
  ASSERT_NEAR(length(n), 1, 1e-12);
  ASSERT_NEAR(length(on_b - on_a), s.distance, exact);
  const double slab = dot(n, wide(at_b.position) - origin) - reach_along(a, at_a, n) - reach_along(b, at_b, -1.0 * n);
  ASSERT_NEAR(slab, s.distance, exact);
}

void prove_pairs(Generator& random, float size_a, float size_b, float spread, Vec3 centre) {
  for (const Shape& a : shapes_of_each_kind(random, size_a))
    for (const Shape& b : shapes_of_each_kind(random, size_b)) {
      const Pose at_a{centre, 0, any_rotation(random)};
      const Pose at_b{centre + spread * in_cube(random), 0, any_rotation(random)};
      SCOPED_TRACE("types " + std::to_string(static_cast<int>(a.type)) + std::to_string(static_cast<int>(b.type)));
      prove(separation({geometry(a), at_a}, {geometry(b), at_b}), a, at_a, b, at_b);
      if (testing::Test::HasFatalFailure()) return;
    }
}

TEST(Separation, IsProvedForEveryPairOfShapes) {
  Generator random(1);
  for (int trial = 0; trial < 3000 && !HasFatalFailure(); ++trial) {
    SCOPED_TRACE("trial " + std::to_string(trial));
    prove_pairs(random, 1, 1, uniform(random, 0.2f, 4), {});
  }
}

TEST(Separation, IsProvedForPebblesAndMountains) {
  Generator random(2);
  for (int trial = 0; trial < 3000 && !HasFatalFailure(); ++trial) {
    SCOPED_TRACE("trial " + std::to_string(trial));
    const float a = std::pow(10.0f, uniform(random, -3, 3)), b = std::pow(10.0f, uniform(random, -3, 3));
    prove_pairs(random, a, b, (a + b) * uniform(random, 0.2f, 3), 10000.f * in_cube(random));
  }
}

TEST(Separation, FindsTouchExactly) {
  const Geometry cube = geometry(box({0.5f, 0.5f, 0.5f}));
  const Pose turned{{1, 0.3f, -0.2f}, 0, {}};
  EXPECT_TRUE(separation({cube, {}}, {cube, turned}).touch());
  Pose apart = turned;
  apart.position.x = std::nextafter(1.0f, 2.0f);
  EXPECT_FALSE(separation({cube, {}}, {cube, apart}).touch());
  EXPECT_DOUBLE_EQ(separation({cube, {}}, {cube, apart}).distance, 0x1p-23);
  const Geometry ball = geometry(sphere(1));
  EXPECT_TRUE(separation({ball, {}}, {ball, {{2, 0, 0}, 0, {}}}).touch());
  EXPECT_FALSE(separation({ball, {}}, {ball, {{std::nextafter(2.0f, 3.0f), 0, 0}, 0, {}}}).touch());
  EXPECT_TRUE(separation({ball, {}}, {ball, {}}).touch()) << "in one place";
}

TEST(Separation, IsSymmetric) {
  Generator random(3);
  for (int trial = 0; trial < 200; ++trial)
    for (const Shape& shape : shapes_of_each_kind(random))
      for (const Shape& other : shapes_of_each_kind(random)) {
        const PlacedShape a(geometry(shape), any_pose(random, 2)), b(geometry(other), any_pose(random, 2));
        const Separation there = separation(a, b), back = separation(b, a);
        ASSERT_EQ(there.touch(), back.touch());
        ASSERT_NEAR(there.distance, back.distance, 1e-12);
      }
}

}  // namespace
}  // namespace fathom::separation_test
