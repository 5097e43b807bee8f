// Contacts of a surface with one shape: which triangles push it, and along which normals.
#include "terrain/surface_contact.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "math/vec3d.hpp"
#include "random.hpp"
#include "test_surfaces.hpp"

namespace fathom::test::surface_contact_test {
namespace {

/// Flat to the left of x = 0; from there on `z = slope x`.
Shape bent_mesh(float slope) {
  return grid_mesh(8, 2, [slope](float x, float) { return std::max(0.0f, slope * x); });
}

/// A plateau that rises to the left, up to x = 0, with a cliff of 1 m there, and the plain below it.
Shape cliff_mesh() {
  const Vec3 v[] = {{-4, -4, 0.4f}, {0, -4, 0},  {0, 4, 0},  {-4, 4, 0.4f},
                    {0, -4, -1},    {4, -4, -1}, {4, 4, -1}, {0, 4, -1}};
  const std::uint32_t indices[] = {0, 1, 2, 0, 2, 3, 1, 4, 7, 1, 7, 2, 4, 5, 6, 4, 6, 7};
  return mesh(v, indices);
}

SurfaceContact contact_of(const Shape& surface, const Shape& shape, const Pose& pose,
                          std::span<const SurfacePush> pushes = {}) {
  SurfaceScratch scratch;
  SurfaceContact contact;
  collide_surface(*surface.surface, geometry(shape), pose, 0.01f, pushes, scratch, contact);
  return contact;
}

/// The deepest separation (m) of the manifold whose normal is closest to `normal`; 1 if none is close.
float deepest_along(const SurfaceContact& contact, Vec3 normal) {
  for (const Manifold& m : std::span(contact.manifolds).first(static_cast<std::size_t>(contact.count)))
    if (dot(m.normal, normal) > 0.99f) return nearest_separation(m);
  return 1;
}

TEST(SurfaceContact, ARodThatHasRunItsEndIntoASlopeIsPushedOutOfIt) {
  const float slope = 0.5f, half_length = 0.8f, half = 0.01f;
  const Shape ground = bent_mesh(slope), rod = box({half_length, half, half});
  const Vec3 up{0, 0, 1}, out = (1 / std::sqrt(1 + slope * slope)) * Vec3{-slope, 0, 1};
  // It lies on the flat part, with a quarter of it in the slope.
  const SurfaceContact contact = contact_of(ground, rod, {{-0.4f, 0.05f, half}, 0, {}});
  EXPECT_NEAR(deepest_along(contact, up), 0, 1e-3f);
  const float depth = 0.4f * slope * out.z;
  EXPECT_NEAR(deepest_along(contact, out), -depth, 0.1f * depth);
}

TEST(SurfaceContact, WhatPassesThroughASurfaceTouchesIt) {
  Generator random(3);
  const Shape ground = wavy_mesh(80);
  constexpr float coarseness = 0.003f;  // m, the triangles are nearer to the waves
  int passing = 0;
  for (int i = 0; i < 20'000; ++i) {
    const float length = uniform(random, 0.05f, 2);
    const Vec3 half{length, length * uniform(random, 0.01f, 0.1f), length * uniform(random, 0.01f, 0.1f)};
    const float x = uniform(random, -2, 2), y = uniform(random, -2, 2);
    const Pose pose{{x, y, wavy_bowl(x, y) + coarseness + uniform(random, 0, 1) * half.y}, 0, any_rotation(random)};
    const auto height_of_end = [&](float side) {
      const Vec3 end = transform(pose, Vec3{side * length, 0, 0});
      return end.z - wavy_bowl(end.x, end.y);
    };
    const auto [lower, upper] = std::minmax({height_of_end(-1), height_of_end(1)});
    if (upper < 0.1f * length || lower > -0.1f * length - coarseness) continue;
    ++passing;
    EXPECT_GT(contact_of(ground, box(half), pose).count, 0) << "rod " << i;
  }
  EXPECT_GT(passing, 5'000);
}

TEST(SurfaceContact, ABoxOnAPlateauIsNotInTheCliffBesideIt) {
  const Shape ground = cliff_mesh(), shape = box({0.5f, 0.5f, 0.5f});
  // As steep as the plateau, or less: then the plateau rises above the plane of its lower face.
  for (const float share : {1.0f, 0.9f, 0.5f})
    for (const float beyond : {-0.1f, 0.05f, 0.2f, 0.45f})
      for (const float depth : {0.0f, 0.001f, 0.01f, 0.05f}) {
        const float angle = share * std::atan(0.1f);
        const Quat tilt{std::cos(0.5f * angle), 0, std::sin(0.5f * angle), 0};
        const float height = (0.5f - depth - beyond * std::sin(angle)) / std::cos(angle);
        const SurfaceContact contact = contact_of(ground, shape, {{beyond, 0.3f, height}, 0, tilt});
        ASSERT_GT(contact.count, 0) << share << " " << beyond << " " << depth;
        for (const Manifold& m : std::span(contact.manifolds).first(static_cast<std::size_t>(contact.count)))
          EXPECT_GT(m.normal.z, 0.9f) << "pushed over the cliff, " << beyond << " m beyond it, " << depth << " m deep";
      }
}

TEST(SurfaceContact, WhatIsPressedInGoesOnToBePushedOut) {
  const Shape ground = flat_mesh(8, 2);
  const Vec3 up{0, 0, 1};
  const SurfacePush upward{up, {}}, along{{1, 0, 0}, {}};
  for (const Shape& shape : {box({0.5f, 0.3f, 0.01f}), capsule(0.01f, 0.3f), sphere(0.1f)}) {
    const float half = shape.type == ShapeType::box ? 0.01f : shape.radius;
    const Pose pose{{0.1f, 0.1f, -0.9f * half}, 0, {}};
    EXPECT_EQ(contact_of(ground, shape, pose).count, 0) << "from behind";
    EXPECT_EQ(contact_of(ground, shape, pose, {&along, 1}).count, 0) << "pushed along the surface";
    EXPECT_NE(deepest_along(contact_of(ground, shape, pose, {&upward, 1}), up), 1) << "pushed out of it";
  }
}

}  // namespace
}  // namespace fathom::test::surface_contact_test
