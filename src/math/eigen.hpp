// Principal axes of a symmetric 3×3 matrix by cyclic Jacobi rotations, in double precision.
//
// Golub, Van Loan: Matrix Computations, 4th ed., section 8.5. A closed formula would be faster but loses half the
// digits if eigenvalues nearly coincide, which is common for inertia tensors.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "math/vec3d.hpp"

namespace fathom {

struct PrincipalFrame {
  Vec3 moments;   ///< eigenvalues, ascending
  Quat rotation;  ///< turns principal axes into the matrix's axes; w ≥ 0
};

namespace eigen_detail {

using Matrix = std::array<std::array<double, 3>, 3>;  // [row][column]

/// One Jacobi rotation in the plane (p, q): makes a[p][q] zero and accumulates the rotation in v.
inline void rotate_away(Matrix& a, Matrix& v, std::size_t p, std::size_t q) {
  if (a[p][q] == 0) return;
  const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
  // The smaller root of t² + 2·theta·t − 1 = 0: the rotation by less than 45 degrees.
  const double t = std::copysign(1.0, theta) / (std::abs(theta) + std::hypot(theta, 1.0));
  const double c = 1 / std::sqrt(t * t + 1), s = t * c;
  for (std::size_t k = 0; k < 3; ++k) {
    const double kp = a[k][p], kq = a[k][q];
    a[k][p] = c * kp - s * kq;
    a[k][q] = s * kp + c * kq;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const double pk = a[p][k], qk = a[q][k];
    a[p][k] = c * pk - s * qk;
    a[q][k] = s * pk + c * qk;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const double kp = v[k][p], kq = v[k][q];
    v[k][p] = c * kp - s * kq;
    v[k][q] = s * kp + c * kq;
  }
  a[p][q] = a[q][p] = 0;
}

/// Quaternion of a rotation matrix, from its largest component (Shepperd 1978).
inline Quat quaternion(const Matrix& m) {
  const double trace = m[0][0] + m[1][1] + m[2][2];
  std::array<double, 4> q{};  // w, x, y, z
  if (trace > std::max({m[0][0], m[1][1], m[2][2]})) {
    q = {1 + trace, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]};
  } else {
    const std::size_t i = m[0][0] >= m[1][1] && m[0][0] >= m[2][2] ? 0 : m[1][1] >= m[2][2] ? 1 : 2;
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    q[0] = m[k][j] - m[j][k];
    q[1 + i] = 1 + m[i][i] - m[j][j] - m[k][k];
    q[1 + j] = m[i][j] + m[j][i];
    q[1 + k] = m[i][k] + m[k][i];
  }
  const double size = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double s = (q[0] < 0 ? -1 : 1) / size;
  return {static_cast<float>(s * q[0]), static_cast<float>(s * q[1]), static_cast<float>(s * q[2]),
          static_cast<float>(s * q[3])};
}

}  // namespace eigen_detail

/// Eigenvalues and eigenvectors of `m`, which must be finite. A diagonal matrix that is already in ascending
/// order gives the identity rotation.
inline PrincipalFrame principal_frame(const SymMat3& m) {
  const double xx = to_double(m.xx), yy = to_double(m.yy), zz = to_double(m.zz);
  const double xy = to_double(m.xy), xz = to_double(m.xz), yz = to_double(m.yz);
  eigen_detail::Matrix a{{{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}}};
  eigen_detail::Matrix v{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  // Convergence is quadratic: 3×3 matrices take four or five sweeps, and ten are never reached.
  for (int sweep = 0; sweep < 10; ++sweep) {
    const double off = std::abs(a[0][1]) + std::abs(a[0][2]) + std::abs(a[1][2]);
    if (off <= 1e-15 * (std::abs(a[0][0]) + std::abs(a[1][1]) + std::abs(a[2][2]))) break;
    eigen_detail::rotate_away(a, v, 0, 1);
    eigen_detail::rotate_away(a, v, 0, 2);
    eigen_detail::rotate_away(a, v, 1, 2);
  }
  std::array<std::size_t, 3> order{0, 1, 2};
  std::stable_sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return a[i][i] < a[j][j]; });
  // An odd permutation of a right-handed frame is left-handed: reverse one axis.
  const bool odd = order[1] != (order[0] + 1) % 3;
  eigen_detail::Matrix r{};
  for (std::size_t row = 0; row < 3; ++row) {
    r[row] = {v[row][order[0]], v[row][order[1]], (odd ? -1 : 1) * v[row][order[2]]};
  }
  return {{static_cast<float>(a[order[0]][order[0]]), static_cast<float>(a[order[1]][order[1]]),
           static_cast<float>(a[order[2]][order[2]])},
          eigen_detail::quaternion(r)};
}

}  // namespace fathom
