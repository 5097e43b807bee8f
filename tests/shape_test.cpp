// Shapes: what they reject, their volumes and their inertia.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fathom/error.hpp>
#include <fathom/shape.hpp>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "geometry/support.hpp"
#include "math/vec3d.hpp"
#include "random.hpp"

namespace fathom::shape_test {
namespace {

using namespace test;

std::vector<Vec3> corners(Vec3 h) {
  std::vector<Vec3> cloud;
  for (int i = 0; i < 8; ++i) cloud.push_back({i & 1 ? h.x : -h.x, i & 2 ? h.y : -h.y, i & 4 ? h.z : -h.z});
  return cloud;
}

void expect_inertia(const SymMat3& actual, const SymMat3& expected, float tolerance) {
  EXPECT_NEAR(actual.xx, expected.xx, tolerance);
  EXPECT_NEAR(actual.yy, expected.yy, tolerance);
  EXPECT_NEAR(actual.zz, expected.zz, tolerance);
  EXPECT_NEAR(actual.xy, expected.xy, tolerance);
  EXPECT_NEAR(actual.xz, expected.xz, tolerance);
  EXPECT_NEAR(actual.yz, expected.yz, tolerance);
}

/// Volume and inertia by counting the cells of a fine grid whose centre is inside.
struct Counted {
  double volume = 0;
  SymMat3 inertia;
};
Counted count_cells(const Shape& shape, float mass, const std::function<bool(Vec3)>& inside) {
  constexpr int n = 100;
  const Aabb box = bounds(geometry(shape), {});
  const Vec3d lower = to_double(box.lower), cell = (1.0 / n) * (to_double(box.upper) - lower);
  double count = 0, xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      for (int k = 0; k < n; ++k) {
        const Vec3d p = lower + Vec3d{(i + 0.5) * cell.x, (j + 0.5) * cell.y, (k + 0.5) * cell.z};
        if (!inside(to_float(p))) continue;
        ++count;
        xx += p.x * p.x, yy += p.y * p.y, zz += p.z * p.z, xy += p.x * p.y, xz += p.x * p.z, yz += p.y * p.z;
      }
    }
  }
  const auto share = [&](double sum) { return static_cast<float>(to_double(mass) * sum / count); };
  return {count * cell.x * cell.y * cell.z,
          {share(yy + zz), share(xx + zz), share(xx + yy), share(-xy), share(-xz), share(-yz)}};
}

void expect_counted(const Shape& shape, const std::function<bool(Vec3)>& inside) {
  const Counted counted = count_cells(shape, 3, inside);
  const MassProperties properties = mass_properties(shape, 3);
  EXPECT_NEAR(to_double(volume(shape)), counted.volume, 0.01 * counted.volume);
  expect_inertia(properties.inertia, counted.inertia, 0.01f * properties.principal_moments.z);
}

TEST(MassProperties, ClosedForms) {
  EXPECT_FLOAT_EQ(volume(sphere(2)), 32.0f / 3 * pi);
  expect_inertia(mass_properties(sphere(2), 5).inertia, {8, 8, 8}, 1e-6f);
  EXPECT_FLOAT_EQ(volume(box({1, 2, 3})), 48);
  expect_inertia(mass_properties(box({1, 2, 3}), 3).inertia, {13, 10, 5}, 1e-6f);
  EXPECT_FLOAT_EQ(volume(capsule(1, 3)), 6 * pi + 4.0f / 3 * pi);
  expect_inertia(mass_properties(capsule(2, 0), 5).inertia, mass_properties(sphere(2), 5).inertia, 1e-6f);
  // A long thin capsule is a rod: m·l²/12.
  EXPECT_NEAR(mass_properties(capsule(1e-4f, 3), 2).inertia.xx, 6, 1e-3f);
}

TEST(MassProperties, UnitCubeOfOneKilogram) {
  const MassProperties p = mass_properties(box({0.5f, 0.5f, 0.5f}), 1);
  EXPECT_EQ(p.mass, 1);
  EXPECT_FLOAT_EQ(p.inertia.xx, 1.0f / 6);
  EXPECT_EQ(p.principal_rotation.w, 1);
}

TEST(MassProperties, SpheresAndCapsulesMatchCountedCells) {
  expect_counted(sphere(1.5f), [](Vec3 p) { return length(p) <= 1.5f; });
  for (const float h : {0.0f, 0.3f, 1.0f, 4.0f}) {
    expect_counted(capsule(0.7f, h), [&](Vec3 p) { return length(p - Vec3{0, 0, clamp(p.z, -h, h)}) <= 0.7f; });
  }
}

TEST(MassProperties, HullsMatchCountedCells) {
  Generator random(1);
  for (int trial = 0; trial < 10; ++trial) {
    std::vector<Vec3> cloud;
    for (int i = 0; i < 12; ++i) cloud.push_back(in_cube(random) + Vec3{0, 3, 0});
    const Shape shape = hull(cloud);
    expect_counted(shape, [&](Vec3 p) {
      for (const Hull::Plane& plane : shape.hull->planes()) {
        if (dot(plane.normal, p) > plane.offset) return false;
      }
      return true;
    });
  }
}

TEST(MassProperties, ABoxGivenAsAHullIsThatBox) {
  Generator random(2);
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3 h{uniform(random, 0.01f, 1), uniform(random, 0.01f, 1), uniform(random, 0.01f, 1)};
    const Quat q = any_rotation(random);
    std::vector<Vec3> cloud = corners(h);
    for (Vec3& p : cloud) p = rotate(q, p) + Vec3{1, -2, 3};
    const Shape b = box(h), c = hull(cloud);
    EXPECT_NEAR(volume(c), volume(b), 1e-5f * volume(b) + 1e-6f);
    EXPECT_LT(distance(c.hull->offset(), {1, -2, 3}), 1e-5f);
    EXPECT_NEAR(c.hull->inner_radius(), min_component(h), 1e-5f);
    EXPECT_NEAR(c.hull->outer_radius(), length(h), 1e-5f);
    expect_inertia(mass_properties(c, 2).inertia, rotated(to_matrix(q), mass_properties(b, 2).inertia), 1e-5f);
  }
}

/// Mass of a solid cylinder and of a cone, and their moments (Goldstein, "Classical Mechanics", 5).
TEST(MassProperties, CylindersAndCones) {
  for (const float size : {0.001f, 1.0f, 1000.0f})
    for (const float slenderness : {0.02f, 1.0f, 50.0f}) {
      const float r = size, h = size * slenderness;  // half the height of the cylinder, the whole height of the cone
      const Shape rod = cylinder(r, h), tip = cone(r, h);
      EXPECT_NEAR(volume(rod) / (2 * pi * r * r * h), 1, 1e-4f);
      EXPECT_NEAR(volume(tip) / (pi * r * r * h / 3), 1, 1e-4f);
      const SymMat3 of_rod = mass_properties(rod, 2).inertia, of_tip = mass_properties(tip, 2).inertia;
      EXPECT_NEAR(of_rod.zz / (r * r), 1, 1e-3f);
      EXPECT_NEAR(of_rod.xx / (0.5f * r * r + 2 * h * h / 3), 1, 1e-3f);
      EXPECT_NEAR(of_tip.zz / (0.6f * r * r), 1, 1e-3f);
      EXPECT_NEAR(of_tip.yy / (0.3f * r * r + 0.075f * h * h), 1, 1e-3f);
      EXPECT_NEAR(tip.hull->offset().z / (-0.25f * h), 1, 1e-3f);
    }
}

TEST(Shape, ACylinderIsAsRoundAsItSays) {
  const Shape rod = cylinder(1, 1);
  for (const Vec3 v : rod.hull->vertices()) EXPECT_NEAR(std::hypot(v.x, v.y), 1, 0.004f);
  for (const Hull::Plane& plane : rod.hull->planes()) EXPECT_NEAR(plane.offset, 1, 0.004f);
  EXPECT_EQ(cylinder(1, 1, 127).hull->planes().size(), 129u);
  EXPECT_EQ(cone(1, 1, 2, 127).hull->vertices().size(), 254u);
  EXPECT_EQ(cone(1, 1, 0, 3).hull->vertices().size(), 4u);
}

TEST(MassProperties, RegularTetrahedron) {
  // Edge a = 2√2: m·a²/20 about every axis.
  const std::vector<Vec3> cloud{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  const Shape shape = hull(cloud);
  EXPECT_FLOAT_EQ(volume(shape), 8.0f / 3);
  expect_inertia(mass_properties(shape, 10).inertia, {4, 4, 4}, 1e-5f);
}

TEST(MassProperties, PrincipalFrameRebuildsTheInertia) {
  Generator random(3);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<Vec3> cloud;
    for (int i = 0; i < 10; ++i) cloud.push_back(in_cube(random));
    const MassProperties p = mass_properties(hull(cloud), 7);
    const Vec3 m = p.principal_moments;
    EXPECT_GT(m.x, 0);
    EXPECT_LE(m.x, m.y);
    EXPECT_LE(m.y, m.z);
    EXPECT_LE(m.z, m.x + m.y) << "the triangle inequality of moments of inertia";
    expect_inertia(rotated(to_matrix(p.principal_rotation), {m.x, m.y, m.z}), p.inertia, 1e-5f);
  }
}

TEST(MassProperties, FarFromTheOriginNothingIsLost) {
  std::vector<Vec3> cloud = corners({0.5f, 0.5f, 0.5f});
  for (Vec3& p : cloud) p += {1000, -2000, 3000};
  const Shape shape = hull(cloud);
  EXPECT_FLOAT_EQ(volume(shape), 1);
  EXPECT_EQ(shape.hull->offset(), (Vec3{1000, -2000, 3000}));
  expect_inertia(mass_properties(shape, 6).inertia, {1, 1, 1}, 1e-6f);
}

void expect_refused(const std::function<void()>& make, ErrorCode code, const std::string& text) {
  try {
    make();
    ADD_FAILURE() << "expected: " << text;
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code);
    EXPECT_THAT(error.what(), testing::HasSubstr(text));
  }
}

TEST(Shape, RefusesBadSizes) {
  constexpr auto invalid = ErrorCode::invalid_argument;
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  expect_refused([] { sphere(0); }, invalid, "fathom::sphere: radius is 0");
  expect_refused([] { sphere(-1); }, invalid, "fathom::sphere: radius is -1");
  expect_refused([] { sphere(nan); }, invalid, "fathom::sphere: radius is nan");
  expect_refused([] { capsule(0, 1); }, invalid, "fathom::capsule: radius is 0");
  expect_refused([] { capsule(1, -1); }, invalid, "fathom::capsule: half_length is -1");
  expect_refused([] { capsule(1, infinity); }, invalid, "fathom::capsule: half_length is inf");
  expect_refused([] { box({0, 1, 1}); }, invalid, "fathom::box: half_extents.x is 0");
  expect_refused([] { box({1, -2, 1}); }, invalid, "fathom::box: half_extents.y is -2");
  expect_refused([] { box({1, 1, infinity}); }, invalid, "fathom::box: half_extents.z is inf");
  expect_refused([] { cylinder(0, 1); }, invalid, "fathom::cylinder: radius is 0");
  expect_refused([] { cylinder(1, nan); }, invalid, "fathom::cylinder: half_height is nan");
  expect_refused([] { cylinder(1, 1, 2); }, invalid, "fathom::cylinder: 2 sides");
  expect_refused([] { cone(1, -1); }, invalid, "fathom::cone: height is -1");
  expect_refused([] { cone(1, 1, -1); }, invalid, "fathom::cone: top_radius is -1");
  expect_refused([] { cone(1, 1, 0, 128); }, invalid, "fathom::cone: 128 sides");
  expect_refused([] { sphere(-1e-9f); }, invalid, "fathom::sphere: radius is -1e-09 m");
  EXPECT_NO_THROW(capsule(1, 0));
}

TEST(Shape, RefusesVolumesThatFloatCannotHold) {
  constexpr auto degenerate = ErrorCode::degenerate_shape;
  expect_refused(
      [] {
        box({1, 1e-30f, 1});
      },
      ErrorCode::invalid_argument, "fathom::box: the smallest half extent is 1e-30 m");
  expect_refused([] { capsule(1e-7f, 1); }, ErrorCode::invalid_argument, "fathom::capsule: the radius is 1e-07 m");
  expect_refused([] { sphere(1e-20f); }, degenerate, "fathom::sphere: the volume is too small");
  expect_refused([] { box({1e20f, 1e20f, 1}); }, degenerate, "fathom::box: the volume is too large");
}

TEST(Shape, RefusesBadMasses) {
  for (const float mass : {0.0f, -1.0f, std::numeric_limits<float>::infinity()}) {
    expect_refused([&] { mass_properties(sphere(1), mass); }, ErrorCode::invalid_argument, "mass is");
  }
}

}  // namespace
}  // namespace fathom::shape_test
