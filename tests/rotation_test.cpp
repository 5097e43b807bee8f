// Rotation of bodies, over the whole range of floats that a world accepts.
#include "dynamics/rotation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "random.hpp"

namespace fathom::test::rotation_test {
namespace {

double wide(float x) { return static_cast<double>(x); }
double length_of(Quat q) {
  return std::sqrt(wide(q.w) * wide(q.w) + wide(q.x) * wide(q.x) + wide(q.y) * wide(q.y) + wide(q.z) * wide(q.z));
}
double length_of(Vec3 v) { return std::sqrt(wide(v.x) * wide(v.x) + wide(v.y) * wide(v.y) + wide(v.z) * wide(v.z)); }

class Rotations : public testing::Test {
 protected:
  Generator random_{7};

  float uniform(float lo, float hi) { return test::uniform(random_, lo, hi); }
  /// Any magnitude between two powers of ten.
  float magnitude(float from, float to) { return std::pow(10.0f, uniform(from, to)); }
  Vec3 direction() { return on_sphere(random_); }
  Quat orientation() { return normalize(Quat{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}); }
};

TEST_F(Rotations, ExponentialIsExactForAnyAngle) {
  for (int i = 0; i < 200000; ++i) {
    const float angle = magnitude(-6, 4.5f);
    const Vec3 axis = direction(), phi = angle * axis;
    const Quat q = exponential(phi);
    ASSERT_NEAR(length_of(q), 1, 3e-7) << angle;
    const double true_angle = length_of(phi), half = std::remainder(0.5 * true_angle, std::acos(-1.0));
    const double c = std::cos(half), s = std::sin(half) / true_angle;
    // Both signs are the same rotation.
    const double sign =
        c * wide(q.w) + s * (wide(phi.x) * wide(q.x) + wide(phi.y) * wide(q.y) + wide(phi.z) * wide(q.z)) < 0 ? -1 : 1;
    const double tolerance = 3e-7 + 2e-7 * true_angle;  // for the rounding of the angle itself
    ASSERT_NEAR(sign * wide(q.w), c, tolerance) << angle;
    ASSERT_NEAR(sign * wide(q.x), s * wide(phi.x), tolerance) << angle;
    ASSERT_NEAR(sign * wide(q.y), s * wide(phi.y), tolerance) << angle;
    ASSERT_NEAR(sign * wide(q.z), s * wide(phi.z), tolerance) << angle;
  }
}

TEST_F(Rotations, TurnedStaysOfUnitLengthForAnyFiniteVector) {
  for (int i = 0; i < 200000; ++i) {
    const Quat q = turned(orientation(), magnitude(-38, 38.4f) * direction());
    ASSERT_NEAR(length_of(q), 1, 3e-7);
  }
  constexpr float most = std::numeric_limits<float>::max();
  EXPECT_NEAR(length_of(turned(Quat{}, Vec3{most, most, most})), 1, 3e-7);
}

TEST_F(Rotations, RenormalisedIsSafeForAnyLength) {
  for (int i = 0; i < 100000; ++i) {
    const float size = magnitude(-12, 12);
    const Quat q = orientation(), r = renormalised({size * q.w, size * q.x, size * q.y, size * q.z});
    ASSERT_NEAR(length_of(r), 1, 3e-6) << size;
  }
}

TEST_F(Rotations, LimitedCutsToTheLimitAndLeavesTheRest) {
  for (int i = 0; i < 100000; ++i) {
    const Vec3 v = magnitude(-30, 38) * direction();
    const float limit = magnitude(-3, 6);
    const Vec3 cut = limited(v, limit);
    ASSERT_TRUE(cut == v || length_of(v) >= 0.999 * wide(limit));
    ASSERT_LE(length_of(cut), 1.000001 * wide(limit));
    ASSERT_GE(length_of(cut), 0.999999 * std::min(length_of(v), wide(limit)));
  }
}

/// A solid box's inertia, in its own axes or any others.
struct Solid {
  SymMat3 inertia, inverse_inertia;

  Solid(Vec3 half, float mass, Quat axes) {
    const float third = mass / 3;
    const SymMat3 principal{third * (half.y * half.y + half.z * half.z),
                            third * (half.x * half.x + half.z * half.z),
                            third * (half.x * half.x + half.y * half.y),
                            0,
                            0,
                            0};
    const SymMat3 inverse{1 / principal.xx, 1 / principal.yy, 1 / principal.zz, 0, 0, 0};
    inertia = rotated(to_matrix(axes), principal);
    inverse_inertia = rotated(to_matrix(axes), inverse);
  }
  double energy(Quat q, Vec3 w) const {
    const Vec3 spin = inverse_rotate(q, w), momentum = inertia * spin;
    return 0.5 * (wide(spin.x) * wide(momentum.x) + wide(spin.y) * wide(momentum.y) + wide(spin.z) * wide(momentum.z));
  }
  Vec3 momentum(Quat q, Vec3 w) const { return rotate(q, inertia * inverse_rotate(q, w)); }
};

// Sizes from 1 mm to 1 km, slenderness to 1000:1, spins to 1000 rad/s and, clamped, far beyond.
TEST_F(Rotations, TorqueFreeStepsNeitherGainEnergyNorDiverge) {
  for (int i = 0; i < 2000; ++i) {
    const float size = magnitude(-3, 3), slender = magnitude(-3, 0), other = magnitude(-3, 0);
    const Solid body(size * Vec3{1, slender, i % 3 == 0 ? slender : other}, 1000 * size * size * size, {});
    Quat q = orientation();
    Vec3 w = magnitude(-3, i % 10 == 0 ? 30 : 3) * direction();
    const float h = 1.0f / 240;
    const double energy = body.energy(q, limited(w, max_turn / h));
    for (int step = 0; step < 240; ++step) {
      step_torque_free(q, w, body.inertia, body.inverse_inertia, h);
      ASSERT_NEAR(length_of(q), 1, 1e-6);
      ASSERT_TRUE(is_finite(w));
      ASSERT_LE(body.energy(q, w), 1.002 * energy) << "size " << size << ", " << slender << " " << other;
    }
  }
}

// If a substep turns a body by less than a quarter of a radian, angular momentum is conserved.
TEST_F(Rotations, TorqueFreeStepsKeepTheMomentum) {
  for (int i = 0; i < 500; ++i) {
    const float slender = magnitude(-1.7f, 0);
    const Solid body({1, slender, uniform(slender, 1)}, 1, orientation());
    Quat q = orientation();
    Vec3 w = magnitude(-1, 1.7f) * direction();
    const Vec3 before = body.momentum(q, w);
    const double energy = body.energy(q, w);
    for (int step = 0; step < 2400; ++step) step_torque_free(q, w, body.inertia, body.inverse_inertia, 1.0f / 240);
    ASSERT_LT(length_of(body.momentum(q, w) - before), 2e-3 * length_of(before)) << slender << " " << length_of(w);
    ASSERT_NEAR(body.energy(q, w), energy, 2e-3 * energy) << slender;
  }
}

// Against steps a thousand times smaller, in double precision.
TEST_F(Rotations, TorqueFreeStepsFollowEulersEquations) {
  for (int i = 0; i < 50; ++i) {
    const Vec3 half{1, magnitude(-1.7f, 0), magnitude(-1.7f, 0)};
    const Solid body(half, 1, {});
    const double moments[3] = {wide(body.inertia.xx), wide(body.inertia.yy), wide(body.inertia.zz)};
    Quat q;
    Vec3 w = uniform(1, 10) * direction();
    double spin[3] = {wide(w.x), wide(w.y), wide(w.z)};
    const double dt = 1.0 / 240 / 1000;
    for (int step = 0; step < 24; ++step) {
      step_torque_free(q, w, body.inertia, body.inverse_inertia, 1.0f / 240);
      for (int k = 0; k < 1000; ++k) {
        const double x = spin[0] + dt * (moments[1] - moments[2]) / moments[0] * spin[1] * spin[2];
        const double y = spin[1] + dt * (moments[2] - moments[0]) / moments[1] * spin[2] * spin[0];
        const double z = spin[2] + dt * (moments[0] - moments[1]) / moments[2] * spin[0] * spin[1];
        spin[0] = x, spin[1] = y, spin[2] = z;
      }
    }
    const Vec3 found = inverse_rotate(q, w);
    const double size = length_of(w);
    ASSERT_NEAR(wide(found.x), spin[0], 2e-3 * size);
    ASSERT_NEAR(wide(found.y), spin[1], 2e-3 * size);
    ASSERT_NEAR(wide(found.z), spin[2], 2e-3 * size);
  }
}

}  // namespace
}  // namespace fathom::test::rotation_test
