// The inverse inertia of one body as constraints use it: which kind of inverse_inertia-inl.hpp it is, and how the 6×6
// one is made. Pure, for host and device.
#pragma once

#include <cmath>
#include <cstddef>
#include <type_traits>

#include "dynamics/lane_scalar.hpp"
#include "dynamics/solver_body.hpp"

namespace fathom {

#define FATHOM_LANE_FUNCTION FATHOM_HD
#include "dynamics/inverse_inertia-inl.hpp"
#undef FATHOM_LANE_FUNCTION

/// Whether a movable body has several principal moments: it has a mass but no single inverse inertia.
FATHOM_HD bool is_anisotropic(float inverse_mass, float inverse_inertia) {
  return inverse_mass > 0 && inverse_inertia == 0;
}
FATHOM_HD bool is_anisotropic(const SolverBody& body) {
  return is_anisotropic(body.inverse_mass, body.inverse_inertia);
}

FATHOM_HD SymMat3 tensor(float multiple) { return {multiple, multiple, multiple, 0, 0, 0}; }
FATHOM_HD SymMat3 tensor(const WorldInertia& w) { return {w.xx, w.yy, w.zz, w.xy, w.xz, w.yz}; }

/// The inverse inertia of body `i` in world axes, as `Spin`: a float where no body is anisotropic, else a tensor, read
/// from `inertias` for anisotropic bodies.
template <class Spin>
FATHOM_HD Spin world_inertia(const WorldInertia* inertias, std::size_t i, float inverse_mass, float inverse_inertia) {
  if constexpr (std::is_same_v<Spin, float>)
    return inverse_inertia;
  else
    return is_anisotropic(inverse_mass, inverse_inertia) ? tensor(inertias[i]) : tensor(inverse_inertia);
}

/// `Spin` is a float, a tensor, or a whole coupled inertia; with the latter `inverse_mass` is not used here.
template <class Spin>
FATHOM_HD auto inverse_inertia(float inverse_mass, const Spin& spin) {
  if constexpr (std::is_same_v<Spin, CoupledInertia<float>>)
    return spin;
  else
    return InverseInertia<float, Spin>{inverse_mass, spin};
}

/// A tensor in body axes, for a body with this orientation.
struct BodyTensor {
  Quat rotation;
  const SymMat3& inverse;

  FATHOM_HD Vec3 operator*(Vec3 v) const { return rotate(rotation, inverse * inverse_rotate(rotation, v)); }
};

/// Calls `act` with the inverse inertia of a body: `isotropic` (1/(kg·m²)), or where that is 0 the `tensor`.
template <class Tensor, class Act>
FATHOM_HD auto with_inverse_inertia(float inverse_mass, float isotropic, const Tensor& tensor, const Act& act) {
  if (isotropic > 0) return act(inverse_inertia(inverse_mass, isotropic));
  return act(inverse_inertia(inverse_mass, tensor));
}

/// The moment (N·m·s) that gives a body a spin (rad/s).
FATHOM_HD Vec3 moment_of(const InverseInertia<float, float>& inertia, Vec3 angular) {
  return (1.0f / inertia.spin) * angular;
}
FATHOM_HD Vec3 moment_of(const InverseInertia<float, SymMat3>& inertia, Vec3 angular) {
  return inverse(to_matrix(inertia.spin)) * angular;
}

/// The inertia of a body and the water that it carries along: its kinetic energy is half of v·linear v + 2 v·coupling ω
/// + ω·angular ω. Symmetric and positive definite as a whole.
struct CoupledMass {
  SymMat3 linear;   ///< kg
  Mat3 coupling;    ///< kg·m, by columns: momentum due to a unit spin about each axis
  SymMat3 angular;  ///< kg·m²
};

/// Its inverse, to full float precision, since it is computed once per body: by Cholesky's method in double precision,
/// with every degree of freedom in units that make its own mass 1.
inline CoupledInertia<float> inverse(const CoupledMass& mass) {
  constexpr int n = 6;
  double m[n][n], unit[n], inverse[n][n] = {};
  const Mat3 linear = to_matrix(mass.linear), angular = to_matrix(mass.angular);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j)
      m[i][j] = static_cast<double>(i < 3 ? linear(i, j) : j < 3 ? mass.coupling(j, i - 3) : angular(i - 3, j - 3));
  for (int i = 0; i < n; ++i) unit[i] = 1 / std::sqrt(m[i][i]);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j) {
      double sum = m[i][j] * unit[i] * unit[j];
      for (int k = 0; k < j; ++k) sum -= m[i][k] * m[j][k];
      m[i][j] = i == j ? std::sqrt(sum) : sum / m[j][j];  // the factor, below the diagonal
    }
  for (int c = 0; c < n; ++c) {
    double x[n];
    for (int i = 0; i < n; ++i) {
      x[i] = i == c ? 1 : 0;
      for (int k = 0; k < i; ++k) x[i] -= m[i][k] * x[k];
      x[i] /= m[i][i];
    }
    for (int i = n - 1; i >= 0; --i) {
      for (int k = i + 1; k < n; ++k) x[i] -= m[k][i] * x[k];
      x[i] /= m[i][i];
      inverse[i][c] = x[i] * unit[i] * unit[c];
    }
  }
  const auto at = [&](int i, int j) { return static_cast<float>(inverse[i][j]); };
  const auto symmetric = [&](int i) {
    return SymMat3{at(i, i), at(i + 1, i + 1), at(i + 2, i + 2), at(i + 1, i), at(i + 2, i), at(i + 2, i + 1)};
  };
  const auto column = [&](int j) { return Vec3{at(0, j), at(1, j), at(2, j)}; };
  return {symmetric(0), column(3), column(4), column(5), symmetric(3)};
}

/// Rotated from a body's axes to the world's.
FATHOM_HD CoupledInertia<float> rotated(const Mat3& r, const CoupledInertia<float>& w) {
  const Mat3 turned = r * Mat3{w.by_x, w.by_y, w.by_z} * transpose(r);
  return {rotated(r, w.linear), turned.x, turned.y, turned.z, rotated(r, w.angular)};
}

}  // namespace fathom
