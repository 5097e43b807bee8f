// Bodies in water for tests: random 6×6 masses and products with them, in double precision.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "dynamics/inverse_inertia.hpp"
#include "random.hpp"

namespace fathom::test {

using Vec6 = std::array<double, 6>;
using Mat6 = std::array<Vec6, 6>;

inline double wide(float x) { return static_cast<double>(x); }

inline Mat6 matrix(const CoupledMass& mass) {
  Mat6 m{};
  const Mat3 linear = to_matrix(mass.linear), angular = to_matrix(mass.angular);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      m[i][j] = wide(linear(i, j));
      m[3 + i][3 + j] = wide(angular(i, j));
      m[i][3 + j] = m[3 + j][i] = wide(mass.coupling(i, j));
    }
  return m;
}
inline Mat6 matrix(const CoupledInertia<float>& w) {
  return matrix(CoupledMass{w.linear, {w.by_x, w.by_y, w.by_z}, w.angular});
}

inline Vec6 product(const Mat6& m, const Vec6& v) {
  Vec6 result{};
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) result[i] += m[i][j] * v[j];
  return result;
}

inline Vec6 joined(Vec3 a, Vec3 b) { return {wide(a.x), wide(a.y), wide(a.z), wide(b.x), wide(b.y), wide(b.z)}; }
inline double dot(const Vec6& a, const Vec6& b) {
  double sum = 0;
  for (int i = 0; i < 6; ++i) sum += a[i] * b[i];
  return sum;
}

/// Creates masses of bodies in water.
class CoupledMassTest : public testing::Test {
 protected:
  Generator random_{23};

  float magnitude(float from, float to) { return std::pow(10.0f, uniform(random_, from, to)); }
  /// A dry body, and water that it carries along: a different mass along each axis, centred elsewhere in the body.
  CoupledMass any_mass(float size) {
    CoupledMass total{{}, {{}, {}, {}}, {}};
    const float dry = magnitude(0, 4) * size * size * size;
    add(total, dry * Vec3{1, 1, 1}, 0.4f * dry * size * size * extents(), {}, {1, 0, 0, 0});
    for (int part = 0; part < 2; ++part) {
      const float water = 1000 * size * size * size;
      add(total, water * extents(), water * size * size * extents(), 0.3f * size * in_cube(random_),
          any_rotation(random_));
    }
    return total;
  }
  Vec3 extents() { return {magnitude(-2, 0), magnitude(-2, 0), magnitude(-2, 0)}; }

  /// Adds principal masses and moments with axes `turn` about a centre `at` in the body's frame.
  static void add(CoupledMass& to, Vec3 mass, Vec3 inertia, Vec3 at, Quat turn) {
    const Mat3 r = to_matrix(turn);
    const SymMat3 m = rotated(r, SymMat3{mass.x, mass.y, mass.z, 0, 0, 0});
    const SymMat3 i = rotated(r, SymMat3{inertia.x, inertia.y, inertia.z, 0, 0, 0});
    // Momentum of a spin w about the origin: m (w × at); moment of momentum: i w + at × m (w × at).
    const Vec3 axes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    Vec3 momentum[3], moment[3];
    for (int k = 0; k < 3; ++k) momentum[k] = m * cross(axes[k], at), moment[k] = i * axes[k] + cross(at, momentum[k]);
    to.linear = sum(to.linear, m);
    to.coupling = to.coupling + Mat3{momentum[0], momentum[1], momentum[2]};
    to.angular = sum(to.angular, {moment[0].x, moment[1].y, moment[2].z, moment[1].x, moment[2].x, moment[2].y});
  }
  static SymMat3 sum(const SymMat3& a, const SymMat3& b) {
    return {a.xx + b.xx, a.yy + b.yy, a.zz + b.zz, a.xy + b.xy, a.xz + b.xz, a.yz + b.yz};
  }
};

}  // namespace fathom::test
