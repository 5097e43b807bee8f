// The validation suite's own measure of what lies in or below a surface, against known depths and heights.
#include "validate/exact_surface.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "test_surfaces.hpp"

namespace fathom::validate::exact_surface_test {
namespace {

Pose at(Vec3 position, Quat rotation = {}) { return {position, 0, rotation}; }

double depth(const Shape& surface, const Pose& pose, const Shape& shape, const Pose& where) {
  const Solid solid(shape, where);
  return depths_in(*surface.surface, pose, {&solid, 1})[0];
}

/// Level, 10 m wide, with 50 triangles and no vertex in the middle.
Shape plane() {
  return test::grid_mesh(5, 5, [](float, float) { return 0.0f; });
}

/// A ridge along y with slopes of 45°.
Shape roof() {
  return test::grid_mesh(4, 4, [](float x, float) { return -std::abs(x); });
}

const Quat lying{std::sqrt(0.5f), std::sqrt(0.5f), 0, 0};  // z becomes −y

TEST(ExactSurface, BodiesOnAPlane) {
  const Shape ground = plane();
  for (const float x : {0.0f, 0.3f, 1.0f}) {  // within a triangle, over the diagonals, over a seam
    SCOPED_TRACE(x);
    EXPECT_EQ(depth(ground, at({}), sphere(1), at({x, 0, 1.01f})), 0);
    EXPECT_NEAR(depth(ground, at({}), sphere(1), at({x, 0, 0.75f})), 0.25, 1e-6);
    EXPECT_NEAR(depth(ground, at({}), box({0.5f, 0.5f, 0.25f}), at({x, 0, 0.125f})), 0.125, 1e-6);
    EXPECT_NEAR(depth(ground, at({}), capsule(0.25f, 1), at({x, 0, 0.125f}, lying)), 0.125, 1e-6);
    EXPECT_NEAR(depth(ground, at({}), capsule(0.25f, 1), at({x, 0, 1.125f})), 0.125, 1e-6);  // upright
  }
}

TEST(ExactSurface, AFieldAndAMeshAreTheSame) {
  const float level[] = {0, 0, 0, 0};
  const Shape field = height_field({2, 2, 10, 10, level});
  for (const float z : {0.75f, 1.25f})
    EXPECT_NEAR(depth(field, at({-5, -5, 0}), sphere(1), at({0.5f, 0, z})),
                depth(plane(), at({}), sphere(1), at({0.5f, 0, z})), 1e-9);
}

TEST(ExactSurface, BodiesOverAnEdge) {
  const Shape ridge = roof();
  EXPECT_NEAR(depth(ridge, at({}), box({1, 1, 0.5f}), at({0, 0, 0.375f})), 0.125, 1e-6);  // rides on it
  EXPECT_EQ(depth(ridge, at({}), box({1, 1, 0.5f}), at({0, 0, 0.51f})), 0);
  // A ball beside the ridge is as deep as in the slope alone.
  const float root = std::sqrt(0.5f);
  EXPECT_NEAR(depth(ridge, at({}), sphere(0.5f), at({1 + 0.25f * root, 0, -1 + 0.25f * root})), 0.25, 1e-6);
  // A box beside the end of the plane, overlapping it by 5 cm.
  EXPECT_NEAR(depth(plane(), at({}), box({1, 1, 1}), at({5.95f, 0, 0})), 0.05, 1e-6);
  EXPECT_EQ(depth(plane(), at({}), box({1, 1, 1}), at({6.01f, 0, 0})), 0);
}

TEST(ExactSurface, GoesWithItsPose) {
  const Pose pose = at({3, -2, 7}, lying);  // faces −y
  EXPECT_NEAR(depth(plane(), pose, sphere(1), at({3, -2.75f, 7})), 0.25, 1e-6);
  EXPECT_EQ(depth(plane(), pose, sphere(1), at({3, -3.01f, 7})), 0);
}

TEST(ExactSurface, HolesHoldNobody) {
  const float level[16] = {};
  const bool holes[9] = {false, false, false, false, true, false, false, false, false};
  const Shape field = height_field({4, 4, 1, 1, level, holes});
  EXPECT_EQ(depth(field, at({}), sphere(0.45f), at({1.5f, 1.5f, 0})), 0);
  EXPECT_NEAR(depth(field, at({}), sphere(0.75f), at({1.5f, 1.5f, 0})), 0.25, 1e-6);  // in its edges
  EXPECT_NEAR(depth(field, at({}), capsule(0.75f, 0.2f), at({1.5f, 1.5f, 0}, lying)), 0.45, 1e-6);
  const Ground ground(*field.surface);
  EXPECT_FALSE(ground.height_over(at({}), {1.5, 1.5, 3}).has_value());
  EXPECT_NEAR(ground.height_over(at({}), {0.5, 1.5, 3}).value(), 3, 1e-9);
}

TEST(ExactSurface, DepthsOfManyAreThoseOfEach) {
  const Shape bowl = test::wavy_mesh();
  std::vector<Solid> solids;
  for (int i = 0; i < 20; ++i) {
    const float x = 0.4f * static_cast<float>(i) - 4;
    solids.emplace_back(sphere(0.5f), at({x, 0.3f, test::wavy_bowl(x, 0.3f) + 0.3f}));
  }
  const std::vector<double> depths = depths_in(*bowl.surface, at({}), solids);
  for (std::size_t i = 0; i < solids.size(); ++i) {
    EXPECT_EQ(depths[i], depths_in(*bowl.surface, at({}), {&solids[i], 1})[0]) << i;
    EXPECT_GT(depths[i], 0.1) << i;
    EXPECT_LT(depths[i], 0.5) << i;
  }
}

TEST(ExactSurface, HeightsOverASlope) {
  const auto slope = [](float x, float y) { return 0.5f * x - 0.25f * y; };
  const Shape mesh = test::grid_mesh(7, 3, slope);
  const Ground ground(*mesh.surface);
  for (float x = -2.9f; x < 3; x += 0.37f)
    for (float y = -2.9f; y < 3; y += 0.41f) {
      const Vec3d above = to_double(Vec3{x, y, slope(x, y) + 2}), below = to_double(Vec3{x, y, slope(x, y) - 1});
      EXPECT_NEAR(ground.height_over(at({}), above).value(), 2, 1e-5);
      EXPECT_NEAR(ground.height_over(at({}), below).value(), -1, 1e-5);
    }
  EXPECT_FALSE(ground.height_over(at({}), {3.1, 0, 0}).has_value());
  EXPECT_FALSE(ground.height_over(at({}), {0, -3.1, 0}).has_value());
  // Rotated by a quarter turn about x and moved: z of the surface is −y.
  EXPECT_NEAR(ground.height_over(at({1, 2, 3}, lying), {1, 0, 3}).value(), 2, 1e-5);
}

}  // namespace
}  // namespace fathom::validate::exact_surface_test
