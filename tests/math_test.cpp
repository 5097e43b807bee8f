// Identities of vectors, rotations, matrices and boxes.
#include <gtest/gtest.h>

#include <limits>

#include "math/eigen.hpp"
#include "random.hpp"

namespace fathom::math_test {
namespace {

using namespace test;

constexpr int trials = 2000;

Mat3 any_matrix(Generator& random) { return {in_cube(random), in_cube(random), in_cube(random)}; }
SymMat3 any_symmetric(Generator& random) {
  const Vec3 d = in_cube(random), o = in_cube(random);
  return {d.x, d.y, d.z, o.x, o.y, o.z};
}
float difference(const Mat3& a, const Mat3& b) {
  const Mat3 d = abs(a + -1.f * b);
  return max_component(max(d.x, max(d.y, d.z)));
}
/// q and −q are the same rotation.
float difference(Quat a, Quat b) { return 1 - fathom::abs(dot(a, b)); }

TEST(Math, FmaRoundsOnce) {
  const float a = 1 + 0x1p-12f;
  EXPECT_EQ(fma(a, a, -1 - 0x1p-11f), 0x1p-24f);
}

TEST(Math, FiniteMeansNeitherInfiniteNorNan) {
  using Limits = std::numeric_limits<float>;
  EXPECT_TRUE(is_finite(0.0f));
  EXPECT_TRUE(is_finite(Limits::max()));
  EXPECT_TRUE(is_finite(Limits::denorm_min()));
  EXPECT_FALSE(is_finite(Limits::infinity()));
  EXPECT_FALSE(is_finite(-Limits::infinity()));
  EXPECT_FALSE(is_finite(Limits::quiet_NaN()));
  EXPECT_FALSE(is_finite(Pose{{0, Limits::quiet_NaN(), 0}, 0, {}}));
  EXPECT_FALSE(is_finite(Pose{{}, 0, {1, 0, Limits::infinity(), 0}}));
}

TEST(Vec3, CrossIsPerpendicularAndAnticommutes) {
  Generator random(1);
  for (int i = 0; i < trials; ++i) {
    const Vec3 a = in_cube(random), b = in_cube(random);
    ASSERT_EQ(cross(a, a), Vec3{});
    ASSERT_EQ(cross(a, b), -cross(b, a));
    ASSERT_NEAR(dot(cross(a, b), a), 0, 1e-6f);
    // Lagrange: |a × b|² + (a·b)² = |a|²·|b|².
    ASSERT_NEAR(length_squared(cross(a, b)) + dot(a, b) * dot(a, b), length_squared(a) * length_squared(b), 1e-5f);
  }
}

TEST(Vec3, NormalizeGivesUnitLengthOrTheFallback) {
  Generator random(2);
  for (int i = 0; i < trials; ++i) {
    const Vec3 n = normalize(uniform(random, 1e-6f, 1e6f) * on_sphere(random));
    ASSERT_NEAR(length(n), 1, 3e-7f);
    const Vec3 p = any_perpendicular(n);
    ASSERT_NEAR(length(p), 1, 3e-7f);
    ASSERT_NEAR(dot(n, p), 0, 3e-7f);
  }
  EXPECT_EQ(normalize(Vec3{}), (Vec3{0, 0, 1}));
  EXPECT_EQ(normalize(Vec3{}, {1, 0, 0}), (Vec3{1, 0, 0}));
}

TEST(Quat, RotationsKeepLengthsAndAngles) {
  Generator random(3);
  for (int i = 0; i < trials; ++i) {
    const Quat q = any_rotation(random);
    const Vec3 a = in_cube(random), b = in_cube(random);
    ASSERT_NEAR(length(rotate(q, a)), length(a), 1e-6f);
    ASSERT_NEAR(dot(rotate(q, a), rotate(q, b)), dot(a, b), 2e-6f);
    ASSERT_LT(distance(inverse_rotate(q, rotate(q, a)), a), 2e-6f);
    ASSERT_LT(distance(rotate(q, cross(a, b)), cross(rotate(q, a), rotate(q, b))), 3e-6f) << "right-handed";
  }
}

TEST(Quat, ProductRotatesOneAfterTheOther) {
  Generator random(4);
  for (int i = 0; i < trials; ++i) {
    const Quat p = any_rotation(random), q = any_rotation(random);
    const Vec3 v = in_cube(random);
    ASSERT_LT(distance(rotate(p * q, v), rotate(p, rotate(q, v))), 2e-6f);
    ASSERT_LT(difference(to_matrix(p * q), to_matrix(p) * to_matrix(q)), 2e-6f);
    ASSERT_LT(distance(to_matrix(q) * v, rotate(q, v)), 2e-6f);
  }
}

TEST(Quat, QuarterTurnAboutZ) {
  const float s = fathom::sqrt(0.5f);
  EXPECT_LT(distance(rotate({s, 0, 0, s}, {1, 0, 0}), {0, 1, 0}), 1e-6f);
}

TEST(Quat, NormalizeOfNothingIsTheIdentity) {
  const Quat q = normalize(Quat{0, 0, 0, 0});
  EXPECT_EQ(q.w, 1);
  EXPECT_EQ(q.vector(), Vec3{});
}

TEST(Mat3, InverseTransposeAndDeterminant) {
  Generator random(5);
  for (int i = 0; i < trials; ++i) {
    const Mat3 a = any_matrix(random), b = any_matrix(random);
    ASSERT_NEAR(determinant(a * b), determinant(a) * determinant(b), 1e-5f);
    ASSERT_EQ(difference(transpose(transpose(a)), a), 0);
    const Vec3 v = in_cube(random);
    ASSERT_LT(distance(transpose_mul(a, v), transpose(a) * v), 1e-6f);
    if (fathom::abs(determinant(a)) > 0.1f) {
      ASSERT_LT(difference(a * inverse(a), {}), 1e-4f);
    }
  }
  EXPECT_EQ(difference(inverse(Mat3{{1, 2, 3}, {2, 4, 6}, {0, 0, 1}}), {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}), 0);
}

TEST(Mat3, RotationsAreProper) {
  Generator random(6);
  for (int i = 0; i < trials; ++i) {
    const Mat3 r = to_matrix(any_rotation(random));
    ASSERT_NEAR(determinant(r), 1, 2e-6f);
    ASSERT_LT(difference(r * transpose(r), {}), 1e-6f);
  }
}

TEST(SymMat3, RotatedIsTheTensorInTurnedAxes) {
  Generator random(7);
  for (int i = 0; i < trials; ++i) {
    const SymMat3 m = any_symmetric(random);
    const Quat q = any_rotation(random);
    const Vec3 v = in_cube(random);
    ASSERT_LT(distance(rotated(to_matrix(q), m) * rotate(q, v), rotate(q, m * v)), 5e-6f);
    ASSERT_LT(distance(m * v, to_matrix(m) * v), 1e-6f);
  }
}

TEST(Pose, RelativeUndoesTheProduct) {
  Generator random(8);
  for (int i = 0; i < trials; ++i) {
    const Pose a = any_pose(random, 3), b = any_pose(random, 3);
    const Vec3 v = in_cube(random);
    ASSERT_LT(distance(transform(a * b, v), transform(a, transform(b, v))), 5e-6f);
    ASSERT_LT(distance(inverse_transform(a, transform(a, v)), v), 2e-6f);
    const Pose again = a * relative(a, b);
    ASSERT_LT(distance(again.position, b.position), 1e-5f);
    ASSERT_LT(difference(again.rotation, b.rotation), 1e-6f);
  }
}

TEST(Aabb, OverlapIsSymmetricAndContainsItsParts) {
  Generator random(9);
  for (int i = 0; i < trials; ++i) {
    const auto any_box = [&] {
      const Vec3 p = 2.f * in_cube(random), q = 2.f * in_cube(random);
      return Aabb{min(p, q), max(p, q)};
    };
    const Aabb a = any_box(), b = any_box(), both = merged(a, b);
    ASSERT_EQ(overlaps(a, b), overlaps(b, a));
    ASSERT_TRUE(contains(both, a) && contains(both, b));
    ASSERT_GE(surface_area(both), max(surface_area(a), surface_area(b)));
    ASSERT_TRUE(contains(grown(a, 0.1f), a));
    const Vec3 gap = abs(centre(a) - centre(b)) - half_extents(a) - half_extents(b);
    if (fathom::abs(max_component(gap)) > 1e-5f) {
      ASSERT_EQ(overlaps(a, b), max_component(gap) < 0);
    }
  }
  EXPECT_TRUE(overlaps({{0, 0, 0}, {1, 1, 1}}, {{1, 0, 0}, {2, 1, 1}})) << "touching counts";
}

TEST(PrincipalFrame, RebuildsTheMatrix) {
  Generator random(10);
  for (int i = 0; i < trials; ++i) {
    SymMat3 m = any_symmetric(random);
    if (i % 4 == 0) m = rotated(to_matrix(any_rotation(random)), SymMat3{2, 2, 1});  // double eigenvalue
    if (i % 4 == 1) m.xy = m.xz = 0;
    const PrincipalFrame frame = principal_frame(m);
    ASSERT_LE(frame.moments.x, frame.moments.y);
    ASSERT_LE(frame.moments.y, frame.moments.z);
    ASSERT_NEAR(dot(frame.rotation, frame.rotation), 1, 1e-6f);
    ASSERT_GE(frame.rotation.w, 0);
    const SymMat3 again =
        rotated(to_matrix(frame.rotation), SymMat3{frame.moments.x, frame.moments.y, frame.moments.z, 0, 0, 0});
    ASSERT_LT(difference(to_matrix(again), to_matrix(m)), 3e-6f);
  }
}

TEST(PrincipalFrame, AscendingDiagonalsGiveTheIdentity) {
  for (const SymMat3 m : {SymMat3{1, 2, 3}, SymMat3{1, 1, 1}, SymMat3{1, 1, 2}, SymMat3{}}) {
    const PrincipalFrame frame = principal_frame(m);
    EXPECT_EQ(frame.rotation.w, 1);
    EXPECT_EQ(frame.moments, (Vec3{m.xx, m.yy, m.zz}));
  }
}

TEST(PrincipalFrame, AnyOrderOfTheDiagonal) {
  for (const SymMat3 m : {SymMat3{1, 3, 2}, SymMat3{2, 1, 3}, SymMat3{2, 3, 1}, SymMat3{3, 1, 2}, SymMat3{3, 2, 1}}) {
    const PrincipalFrame frame = principal_frame(m);
    EXPECT_EQ(frame.moments, (Vec3{1, 2, 3}));
    EXPECT_LT(difference(to_matrix(rotated(to_matrix(frame.rotation), SymMat3{1, 2, 3})), to_matrix(m)), 2e-6f);
  }
}

}  // namespace
}  // namespace fathom::math_test
