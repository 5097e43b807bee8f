// Separating axes of two boxes: three faces each and nine pairs of edges.
//
// The projections are those of S. Gottschalk, M. C. Lin, D. Manocha, "OBBTree", SIGGRAPH 1996: with the rotation
// matrix between the boxes and its absolute values every axis costs a handful of multiplications.
#pragma once

#include "collision/manifold.hpp"
#include "collision/tolerance.hpp"

namespace fathom {

/// Two boxes as the axis tests read them. Indices i are axes of A, j of B.
struct BoxPair {
  float ha[3], hb[3];  ///< half extents
  float r[3][3];       ///< r[i][j]: component along axis i of A of axis j of B
  float q[3][3];       ///< absolute values of r
  float ta[3], tb[3];  ///< from centre of A to centre of B in the axes of A and of B
  Tolerance tolerance;
};

FATHOM_HD void copy(float (&to)[3], Vec3 from) { to[0] = from.x, to[1] = from.y, to[2] = from.z; }

FATHOM_HD BoxPair make_box_pair(Vec3 ha, Vec3 hb, const Pose& b_in_a) {
  BoxPair pair;
  const Mat3 r = to_matrix(b_in_a.rotation);
  copy(pair.ha, ha);
  copy(pair.hb, hb);
  copy(pair.r[0], {r.x.x, r.y.x, r.z.x});
  copy(pair.r[1], {r.x.y, r.y.y, r.z.y});
  copy(pair.r[2], {r.x.z, r.y.z, r.z.z});
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) pair.q[i][j] = abs(pair.r[i][j]);
  }
  copy(pair.ta, b_in_a.position);
  copy(pair.tb, transpose_mul(r, b_in_a.position));
  const float reach = max_component(ha) + max_component(hb) + max_component(abs(b_in_a.position));
  pair.tolerance = make_tolerance(min(min_component(ha), min_component(hb)), reach);
  return pair;
}

/// Separation (m) along the face normals of axis i of A, of axis j of B.
FATHOM_HD float face_a_separation(const BoxPair& p, int i) {
  return abs(p.ta[i]) - fma(p.q[i][2], p.hb[2], fma(p.q[i][1], p.hb[1], fma(p.q[i][0], p.hb[0], p.ha[i])));
}
FATHOM_HD float face_b_separation(const BoxPair& p, int j) {
  return abs(p.tb[j]) - fma(p.q[2][j], p.ha[2], fma(p.q[1][j], p.ha[1], fma(p.q[0][j], p.ha[0], p.hb[j])));
}

/// Separation along the cross product of two edges, times that product's length.
/// The rounding to expect is taken off: divided by the length of a short product it would make nearly parallel
/// edges look separated. What is left is a lower bound, which sinks below every other axis as the edges align.
struct EdgeAxis {
  float scaled;          ///< separation · length (m)
  float length_squared;  ///< of the cross product of the two unit axes
};
FATHOM_HD EdgeAxis edge_axis(const BoxPair& p, int i, int j) {
  const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
  const float gap = abs(p.ta[i2] * p.r[i1][j] - p.ta[i1] * p.r[i2][j]);
  const float reach_a = fma(p.ha[i1], p.q[i2][j], p.ha[i2] * p.q[i1][j]);
  const float reach_b = fma(p.hb[j1], p.q[i][j2], p.hb[j2] * p.q[i][j1]);
  return {gap - (reach_a + reach_b + p.tolerance.noise), fma(p.r[i1][j], p.r[i1][j], p.r[i2][j] * p.r[i2][j])};
}
FATHOM_HD float separation(EdgeAxis axis) {
  return axis.length_squared > 0 ? axis.scaled / fathom::sqrt(axis.length_squared) : -3e38f;
}

/// x·|x|: order-preserving, so that a / √b > c can be told without root or division as
/// signed_square(a) > signed_square(c)·b.
FATHOM_HD float signed_square(float x) { return x * abs(x); }

}  // namespace fathom
