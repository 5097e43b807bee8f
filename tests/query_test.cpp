// Support points, bounds and rays against sampled surfaces and marched rays.
#include "geometry/query.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "geometry/support.hpp"
#include "random.hpp"

namespace fathom::query_test {
namespace {

using namespace test;

std::vector<Shape> some_shapes(Generator& random) {
  std::vector<Vec3> cloud;
  for (int i = 0; i < 20; ++i) cloud.push_back(in_cube(random));
  const Vec3 h{uniform(random, 0.1f, 2), uniform(random, 0.1f, 2), uniform(random, 0.1f, 2)};
  return {sphere(h.x), capsule(h.y, h.z), capsule(h.y, 0), box(h), hull(cloud)};
}

/// Signed distance bound of a point in the shape's frame: negative inside; written without the code under test.
float height(const Shape& shape, Vec3 p) {
  switch (shape.type) {
    case ShapeType::sphere:
      return length(p) - shape.radius;
    case ShapeType::capsule: {
      const float h = shape.half_extents.z;
      return length(p - Vec3{0, 0, clamp(p.z, -h, h)}) - shape.radius;
    }
    case ShapeType::box:
      return max_component(abs(p) - shape.half_extents);
    case ShapeType::hull:
    case ShapeType::compound:
    case ShapeType::mesh:
    case ShapeType::height_field:
      break;
  }
  float highest = -1e9f;
  for (const Hull::Plane& plane : shape.hull->planes()) highest = max(highest, dot(plane.normal, p) - plane.offset);
  return highest;
}

TEST(Support, IsOnTheSurfaceAndFarthest) {
  Generator random(1);
  for (int trial = 0; trial < 200; ++trial) {
    for (const Shape& shape : some_shapes(random)) {
      const Geometry g = geometry(shape);
      const Vec3 d = uniform(random, 0.01f, 100) * on_sphere(random);
      const Vec3 s = support(g, d);
      ASSERT_NEAR(height(shape, s), 0, 1e-5f);
      ASSERT_LE(length(s), bounding_radius(g) * (1 + 1e-6f));
      for (int i = 0; i < 200; ++i) {
        const Vec3 p = bounding_radius(g) * in_cube(random);
        if (height(shape, p) > 0) continue;
        ASSERT_LE(dot(p, d), dot(s, d) + 1e-5f * length(d));
      }
    }
  }
}

TEST(Bounds, AreTheSupportPointsAlongTheAxes) {
  Generator random(2);
  for (int trial = 0; trial < 1000; ++trial) {
    for (const Shape& shape : some_shapes(random)) {
      const Geometry g = geometry(shape);
      const Pose pose = any_pose(random, 5);
      const Aabb box = bounds(g, pose);
      for (int axis = 0; axis < 3; ++axis) {
        const Vec3 d{axis == 0 ? 1.f : 0.f, axis == 1 ? 1.f : 0.f, axis == 2 ? 1.f : 0.f};
        const Vec3 local = inverse_rotate(pose.rotation, d);
        ASSERT_NEAR(box.upper[axis], transform(pose, support(g, local))[axis], 1e-5f);
        ASSERT_NEAR(box.lower[axis], transform(pose, support(g, -local))[axis], 1e-5f);
      }
    }
  }
}

TEST(Bounds, BoundingRadiusIsReached) {
  EXPECT_FLOAT_EQ(bounding_radius(geometry(sphere(2))), 2);
  EXPECT_FLOAT_EQ(bounding_radius(geometry(capsule(2, 3))), 5);
  EXPECT_FLOAT_EQ(bounding_radius(geometry(box({2, 3, 6}))), 7);
  Generator random(3);
  const Shape shape = some_shapes(random).back();
  EXPECT_FLOAT_EQ(bounding_radius(geometry(shape)), shape.hull->outer_radius());
}

TEST(RayCast, AgreesWithMarching) {
  Generator random(4);
  int hits = 0, misses = 0, inside = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    for (const Shape& shape : some_shapes(random)) {
      SCOPED_TRACE("trial " + std::to_string(trial) + " type " + std::to_string(static_cast<int>(shape.type)));
      const Pose pose = any_pose(random, 3);
      const Vec3 origin = pose.position + 2.f * in_cube(random), target = pose.position + 1.5f * in_cube(random);
      const Vec3 translation = 1.5f * (target - origin);
      const auto at = [&](float t) { return height(shape, inverse_transform(pose, mul_add(origin, t, translation))); };
      const auto hit = ray_cast(geometry(shape), pose, {origin, translation});

      float marched = -1, lowest = 1e9f;
      constexpr int steps = 2000;
      for (int i = 0; i <= steps && marched < 0; ++i) {
        const float t = static_cast<float>(i) / steps;
        lowest = min(lowest, at(t));
        if (at(t) <= 0) marched = t;
      }
      if (marched >= 0) {
        ASSERT_TRUE(hit);
        ASSERT_NEAR(hit->fraction, marched, 1.01f / steps);
      }
      if (!hit) {
        ++misses;
        ASSERT_GT(lowest, 0);
        continue;
      }
      if (at(0) <= 0) {
        ++inside;
        ASSERT_EQ(hit->fraction, 0);
        ASSERT_EQ(length(hit->normal), 0);
        continue;
      }
      ++hits;
      ASSERT_NEAR(at(hit->fraction), 0, 2e-5f);
      ASSERT_NEAR(length(hit->normal), 1, 1e-5f);
      ASSERT_LT(dot(hit->normal, translation), 1e-4f);
      // The normal is the surface's: a step along it leads outside, and the shape lies below its plane.
      const Vec3 local = inverse_rotate(pose.rotation, hit->normal);
      const Vec3 point = inverse_transform(pose, mul_add(origin, hit->fraction, translation));
      ASSERT_LE(dot(local, support(geometry(shape), local)), dot(local, point) + 2e-5f);
    }
  }
  EXPECT_GT(hits, 1000);
  EXPECT_GT(misses, 1000);
  EXPECT_GT(inside, 300);
}

TEST(RayCast, KnownHits) {
  const Pose at{{10, 0, 0}, 0, {}};
  const auto expect = [&](const Shape& shape, Vec3 origin, Vec3 translation, float fraction, Vec3 normal) {
    const auto hit = ray_cast(geometry(shape), at, {origin, translation});
    ASSERT_TRUE(hit);
    EXPECT_FLOAT_EQ(hit->fraction, fraction);
    EXPECT_LT(distance(hit->normal, normal), 1e-6f);
  };
  expect(sphere(1), {0, 0, 0}, {20, 0, 0}, 0.45f, {-1, 0, 0});
  expect(box({1, 2, 3}), {10, 0, 9}, {0, 0, -12}, 0.5f, {0, 0, 1});
  expect(capsule(1, 2), {10, 0, 9}, {0, 0, -12}, 0.5f, {0, 0, 1});
  expect(capsule(1, 2), {10, -5, -1}, {0, 8, 0}, 0.5f, {0, -1, 0});
  expect(capsule(1, 2), {10, 0, -9}, {0, 0, 12}, 0.5f, {0, 0, -1});
}

TEST(RayCast, EndsAreIncluded) {
  const Pose here{};
  EXPECT_TRUE(ray_cast(geometry(box({1, 1, 1})), here, {{3, 0, 0}, {-2, 0, 0}}));
  EXPECT_FALSE(ray_cast(geometry(box({1, 1, 1})), here, {{3, 0, 0}, {-1.999f, 0, 0}}));
  EXPECT_TRUE(ray_cast(geometry(sphere(1)), here, {{3, 0, 0}, {-2, 0, 0}}));
  EXPECT_FALSE(ray_cast(geometry(sphere(1)), here, {{3, 0, 0}, {-1.999f, 0, 0}}));
}

TEST(RayCast, ZeroLengthAsksWhetherThePointIsInside) {
  Generator random(5);
  for (int trial = 0; trial < 300; ++trial) {
    for (const Shape& shape : some_shapes(random)) {
      const Vec3 p = 2.f * in_cube(random);
      if (fathom::abs(height(shape, p)) < 1e-5f) continue;
      EXPECT_EQ(ray_cast(geometry(shape), {}, {p, {0, 0, 0}}).has_value(), height(shape, p) <= 0);
    }
  }
}

TEST(RayCast, SmallSphereFarAway) {
  const auto hit = ray_cast(geometry(sphere(0.1f)), {{1000, 0.05f, 0}, 0, {}}, {{0, 0, 0}, {2000, 0, 0}});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->normal.y, -0.5f, 2e-3f);
}

}  // namespace
}  // namespace fathom::query_test
