// Separating axes of two boxes: three faces each and nine pairs of edges.
//
// The projections are those of S. Gottschalk, M. C. Lin, D. Manocha, "OBBTree", SIGGRAPH 1996: given the rotation
// matrix between the boxes and its absolute values, every axis costs only a few multiplications. Three axes are tested
// side by side, so all six faces cost little more than one.
#pragma once

#include "collision/lanes.hpp"
#include "collision/manifold.hpp"
#include "collision/tolerance.hpp"

namespace fathom {

/// Two boxes as the axis tests read them.
struct BoxPair {
  Lanes ha, hb;          ///< half extents
  Lanes ta, tb;          ///< from A's centre to B's, in the axes of A and of B
  Lanes r[3];            ///< r[i][j]: component along axis i of A of axis j of B
  Lanes q[3];            ///< absolute values of r
  Lanes face_a, face_b;  ///< separations (m) along the face normals of A's and of B's axes
  Tolerance tolerance;
};

FATHOM_HD BoxPair make_box_pair(Vec3 half_a, Vec3 half_b, const Pose& b_in_a) {
  BoxPair p;
  const Vec3 t = b_in_a.position;
  p.ha = lanes(half_a);
  p.hb = lanes(half_b);
  p.ta = lanes(t);

  // Rotation matrix of the quaternion (w, v): (1 − 2v²)·1 + 2·v·vᵀ + 2w·[v]×; its transpose has the last term negative.
  const Vec3 v = b_in_a.rotation.vector();
  const float w2 = 2.0f * b_in_a.rotation.w, diagonal = 1.0f - 2.0f * (v.x * v.x + v.y * v.y + v.z * v.z);
  const Lanes v2 = 2.0f * lanes(v);
  const Lanes even[3] = {v.x * v2 + lanes(diagonal, 0, 0), v.y * v2 + lanes(0, diagonal, 0),
                         v.z * v2 + lanes(0, 0, diagonal)};
  const Lanes odd[3] = {w2 * lanes(0, -v.z, v.y), w2 * lanes(v.z, 0, -v.x), w2 * lanes(-v.y, v.x, 0)};
  Lanes q_column[3];
  for (int i = 0; i < 3; ++i) {
    p.r[i] = even[i] + odd[i];
    p.q[i] = abs(p.r[i]);
    q_column[i] = abs(even[i] - odd[i]);
  }

  p.tb = t.x * p.r[0] + t.y * p.r[1] + t.z * p.r[2];
  const Lanes distance = abs(p.ta);
  p.face_a = distance - p.ha - (half_b.x * q_column[0] + half_b.y * q_column[1] + half_b.z * q_column[2]);
  p.face_b = abs(p.tb) - p.hb - (half_a.x * p.q[0] + half_a.y * p.q[1] + half_a.z * p.q[2]);
  p.tolerance = make_tolerance(min_lane(min(p.ha, p.hb)), max_lane(p.ha + p.hb + distance));
  return p;
}

/// The same pair with A and B swapped.
FATHOM_HD BoxPair swapped(const BoxPair& p) {
  BoxPair s;
  s.ha = p.hb;
  s.hb = p.ha;
  s.ta = -1.0f * p.tb;
  s.tb = -1.0f * p.ta;
  for (int i = 0; i < 3; ++i) {
    s.r[i] = lanes(p.r[0][i], p.r[1][i], p.r[2][i]);
    s.q[i] = abs(s.r[i]);
  }
  s.face_a = p.face_b;
  s.face_b = p.face_a;
  s.tolerance = p.tolerance;
  return s;
}

/// x·|x|: order-preserving, so a / √b > c can be tested without root or division as signed_square(a) >
/// signed_square(c)·b.
FATHOM_HD float signed_square(float x) { return x * abs(x); }

/// Separations along the cross products of edges, times those products' lengths: for one axis of A, for all of B. The
/// expected rounding error is subtracted: divided by the length of a short product, it would make nearly parallel edges
/// look separated. The result is a lower bound, which drops below every other axis as the edges align.
struct EdgeAxes {
  Lanes scaled;          ///< separation · length (m)
  Lanes length_squared;  ///< of the cross product of the two unit axes
};
FATHOM_HD EdgeAxes edge_axes(const BoxPair& p, int i) {
  const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
  const Lanes gap = abs(p.ta[i2] * p.r[i1] - p.ta[i1] * p.r[i2]);
  const Lanes reach_a = p.ha[i1] * p.q[i2] + p.ha[i2] * p.q[i1];
  const Lanes reach_b = yzx(p.hb) * zxy(p.q[i]) + zxy(p.hb) * yzx(p.q[i]);
  const float noise = p.tolerance.noise;
  return {gap - (reach_a + reach_b) - lanes(noise, noise, noise), p.r[i1] * p.r[i1] + p.r[i2] * p.r[i2]};
}
FATHOM_HD float edge_separation(const EdgeAxes& axes, int j) {
  return axes.length_squared[j] > 0 ? axes.scaled[j] / fathom::sqrt(axes.length_squared[j]) : -3e38f;
}

/// Whether any edge axis' separation exceeds the threshold. Identifies most face contacts without a root or a search.
FATHOM_HD bool any_edges_above(const BoxPair& p, float threshold) {
  const float square = signed_square(threshold);
  Lanes excess[3];
  for (int i = 0; i < 3; ++i) {
    const EdgeAxes axes = edge_axes(p, i);
    excess[i] = axes.scaled * abs(axes.scaled) - square * axes.length_squared;
  }
  return max_lane(max(max(excess[0], excess[1]), excess[2])) > 0;
}

/// A pair of edge directions and the separation along their cross product.
struct BoxEdges {
  int i = -1, j = -1;
  float separation = -3e38f;
};

/// The edge axis with the largest separation above `threshold`, if any.
FATHOM_HD BoxEdges best_edges(const BoxPair& pair, float threshold) {
  BoxEdges best;
  float to_beat = threshold;
  for (int i = 0; i < 3; ++i) {
    const EdgeAxes axes = edge_axes(pair, i);
    for (int j = 0; j < 3; ++j) {
      const float separation = edge_separation(axes, j);
      if (separation > to_beat) {
        best = {i, j, separation};
        to_beat = separation;
      }
    }
  }
  return best;
}

}  // namespace fathom
