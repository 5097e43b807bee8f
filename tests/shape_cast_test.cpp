// Moving shapes, against closed forms and against the minimum of their distance, found by sections.
#include <gtest/gtest.h>

#include <string>

#include "geometry/query.hpp"
#include "geometry/separation.hpp"
#include "query_oracle.hpp"

namespace fathom::shape_cast_test {
namespace {

using namespace test;

/// Distance after a fraction of the path; separation_test.cpp proves it.
double distance_at(const PlacedShape& moving, Vec3 way, const PlacedShape& still, double t) {
  const Vec3d shift = t * to_double(way);
  return separation(still, moving, shift, moving.position + shift - still.position).distance;
}

/// The distance is convex along the path: its minimum is found by ternary search, and its zero by bisection. Above 1 if
/// there is none.
double first_touch(const PlacedShape& moving, Vec3 way, const PlacedShape& still) {
  const auto at = [&](double t) { return distance_at(moving, way, still, t); };
  if (at(0) == 0) return 0;
  double low = 0, high = 1;
  for (int i = 0; i < 120 && at(high) > 0; ++i) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    const double at_a = at(a), at_b = at(b);
    if (at_a == 0) {
      high = a;
    } else if (at_b == 0) {
      high = b;
    } else {
      (at_a < at_b ? high : low) = at_a < at_b ? b : a;
    }
  }
  if (at(high) > 0) return 2;
  for (low = 0; high - low > 1e-15;) {
    const double middle = 0.5 * (low + high);
    if (middle == low || middle == high) break;
    (at(middle) > 0 ? low : high) = middle;
  }
  return high;
}

struct Tally {
  int hits = 0, misses = 0, inside = 0;
};

/// Compares a cast with the zero of the distance.
void compare(const PlacedShape& moving, Vec3 way, const PlacedShape& still, Tally& tally) {
  const auto hit = shape_cast(moving, way, still);
  const double expected = first_touch(moving, way, still);
  const double thin = std::min(moving.thinnest, still.thinnest), whole = length(to_double(way));
  if (!hit) {
    ++tally.misses;
    ASSERT_GT(expected, 1) << "missed";
    return;
  }
  ASSERT_LE(distance_at(moving, way, still, to_double(hit->fraction)), 1.1e-6 * thin + 1e-7 * whole);
  if (hit->starts_inside) {
    ++tally.inside;
    ASSERT_EQ(expected, 0);
    ASSERT_EQ(hit->fraction, 0);
    ASSERT_EQ(length(hit->normal), 0);
    return;
  }
  ++tally.hits;
  ASSERT_NEAR(length(hit->normal), 1, 1e-6f);
  ASSERT_LT(dot(hit->normal, way), 0);
  if (expected > 1) return;  // within the tolerance: they graze
  const double closing = -dot(to_double(hit->normal), to_double(way));
  ASSERT_NEAR(to_double(hit->fraction), expected, (2e-6 * thin + 1e-7 * whole) / closing + 1e-7);
  // On the still shape, none of which is beyond the plane.
  const Vec3d n = to_double(hit->normal), on_still = to_double(hit->point) - still.position;
  const double size = length(still.reach()), rounding = 1e-5 * size + 2e-7 * length(to_double(hit->point));
  ASSERT_NEAR(dot(n, on_still), dot(n, still.support(n)) + still.radius, rounding);
}

TEST(ShapeCast, MeetsWhereTheDistanceVanishes) {
  Generator random(1);
  Tally tally;
  for (int trial = 0; trial < 1500 && !HasFatalFailure(); ++trial)
    for (const Shape& a : shapes_of_each_kind(random))
      for (const Shape& b : shapes_of_each_kind(random)) {
        SCOPED_TRACE("trial " + std::to_string(trial) + " types " + std::to_string(static_cast<int>(a.type)) +
                     std::to_string(static_cast<int>(b.type)));
        const PlacedShape moving(geometry(a), any_pose(random, 4)), still(geometry(b), any_pose(random, 1));
        const Vec3 way = uniform(random, 0.5f, 2) * (to_float(still.position - moving.position) + in_cube(random));
        compare(moving, way, still, tally);
        if (HasFatalFailure()) return;
      }
  EXPECT_GT(tally.hits, 8000);
  EXPECT_GT(tally.misses, 3000);
  EXPECT_GT(tally.inside, 200);
}

TEST(ShapeCast, MeetsPebblesAndMountainsFarAway) {
  Generator random(2);
  Tally tally;
  for (int trial = 0; trial < 600 && !HasFatalFailure(); ++trial) {
    const float size_a = std::pow(10.0f, uniform(random, -3, 3)), size_b = std::pow(10.0f, uniform(random, -3, 3));
    const Vec3 centre = 10000.f * in_cube(random), from = centre + 1000.f * in_cube(random);
    for (const Shape& a : shapes_of_each_kind(random, size_a))
      for (const Shape& b : shapes_of_each_kind(random, size_b)) {
        SCOPED_TRACE("trial " + std::to_string(trial) + " types " + std::to_string(static_cast<int>(a.type)) +
                     std::to_string(static_cast<int>(b.type)));
        const PlacedShape moving(geometry(a), {from, 0, any_rotation(random)});
        const PlacedShape still(geometry(b), {centre, 0, any_rotation(random)});
        const Vec3 aim = centre + 0.2f * (size_a + size_b) * in_cube(random);
        compare(moving, 1.2f * (aim - from), still, tally);
        if (HasFatalFailure()) return;
      }
  }
  EXPECT_GT(tally.hits, 3000);
}

// |s + t d| = R is a quadratic equation; its root is exact in double precision.
TEST(ShapeCast, BallsMeetInClosedForm) {
  Generator random(3);
  int hits = 0, misses = 0;
  for (int trial = 0; trial < 30000; ++trial) {
    const float ra = uniform(random, 0.1f, 1), rb = uniform(random, 0.1f, 1);
    const Vec3 from = 5.f * in_cube(random), way = 10.f * in_cube(random);
    const auto hit = shape_cast({geometry(sphere(ra)), {from, 0, {}}}, way, {geometry(sphere(rb)), {}});
    const DVec s = wide(from), d = wide(way);
    const double r = double(ra) + double(rb), a = dot(d, d), b = dot(s, d), c = dot(s, s) - r * r;
    const double root = b * b - a * c, t = root >= 0 ? (-b - std::sqrt(root)) / a : 2;
    if (c <= 0) {
      ASSERT_TRUE(hit && hit->starts_inside);
    } else if (hit) {
      ++hits;
      ASSERT_NEAR(double(hit->fraction), t, 1e-6 + 1e-6 / std::sqrt(std::max(root, 1e-12)));
      ASSERT_LT(length(wide(hit->normal) - (1 / r) * (s + t * d)), 1e-3);
    } else {
      ++misses;
      ASSERT_FALSE(t > 1e-9 && t < 1 - 1e-9 && root > 1e-5) << t;
    }
  }
  EXPECT_GT(hits, 300);
  EXPECT_GT(misses, 300);
}

TEST(ShapeCast, KnownHits) {
  const PlacedShape floor(geometry(box({500, 500, 0.5f})), {});
  const auto expect = [&](const Shape& shape, Vec3 from, Vec3 way, float fraction) {
    const auto hit = shape_cast({geometry(shape), {from, 0, {}}}, way, floor);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->fraction, fraction, 1e-6f);
    EXPECT_LT(distance(hit->normal, {0, 0, 1}), 1e-6f);
    EXPECT_NEAR(hit->point.z, 0.5f, 1e-6f);
  };
  expect(sphere(0.5f), {30, -200, 3}, {0, 0, -4}, 0.5f);
  expect(sphere(0.5f), {30, -200, 3}, {2, 3, -4}, 0.5f);
  expect(capsule(0.5f, 1), {30, -200, 4}, {2, 3, -5}, 0.4f);
  expect(box({1, 1, 1}), {30, -200, 2.5f}, {0, 0, -4}, 0.25f);
  const auto slide = shape_cast({geometry(box({1, 1, 1})), {{0, 0, 1.6f}, 0, {}}}, {5, 0, 0}, floor);
  EXPECT_FALSE(slide) << "it slides along above";
  const auto leave = shape_cast({geometry(sphere(1)), {{0, 0, 1.6f}, 0, {}}}, {0, 0, 5}, floor);
  EXPECT_FALSE(leave) << "it leaves";
  const auto deep = shape_cast({geometry(sphere(1)), {{0, 0, 1.2f}, 0, {}}}, {0, 0, 5}, floor);
  ASSERT_TRUE(deep);
  EXPECT_TRUE(deep->starts_inside);
}

TEST(ShapeCast, TheEndCounts) {
  const PlacedShape wall(geometry(box({1, 1, 1})), {});
  const PlacedShape ball(geometry(sphere(0.5f)), {{4, 0, 0}, 0, {}});
  EXPECT_TRUE(shape_cast(ball, {-2.5f, 0, 0}, wall));
  EXPECT_FALSE(shape_cast(ball, {-2.499f, 0, 0}, wall));
  EXPECT_FALSE(shape_cast(ball, {-3, 0, 0}, wall, 0.8)) << "beyond the limit";
}

}  // namespace
}  // namespace fathom::shape_cast_test
