// The overlap of two box faces, viewed along the normal of one of them: a parallelogram clipped by a rectangle.
//
// In the frame of the reference face the rectangle is axis-aligned, so each edge of the incident face is clipped
// against two slabs (Liang, Barsky 1984) instead of four planes one after the other; the only points that this misses
// are the rectangle's own corners inside the parallelogram.
#pragma once

#include "collision/box_axes.hpp"
#include "collision/feature.hpp"
#include "collision/reduce.hpp"

namespace fathom {

/// The incident face over the reference face. The reference face spans |x| ≤ hx, |y| ≤ hy at z = 0, the
/// incident one centre ± u ± v.
struct BoxFacePair {
  float hx, hy;
  Vec3 centre, u, v;
  int ref_axis, inc_axis;           ///< normals of the faces
  bool ref_positive, inc_positive;  ///< side of their box
  bool flipped;                     ///< A here is B of the pair
};

FATHOM_HD std::uint32_t box_vertex(int axis, bool s0, bool s1, bool s2) {
  return (std::uint32_t{s0} << axis) | (std::uint32_t{s1} << ((axis + 1) % 3)) |
         (std::uint32_t{s2} << ((axis + 2) % 3));
}
/// Undirected edge along `axis` on the given sides of the next two axes.
FATHOM_HD std::uint32_t box_edge(int axis, bool s1, bool s2) {
  return static_cast<std::uint32_t>(axis) * 4 + std::uint32_t{s1} + 2 * std::uint32_t{s2};
}

/// The face of A across `axis` that faces B, and the face of B that faces it.
FATHOM_HD BoxFacePair make_face_pair(const BoxPair& p, int axis, bool flipped) {
  BoxFacePair f;
  const int k = axis, k1 = (k + 1) % 3, k2 = (k + 2) % 3;
  f.flipped = flipped;
  f.ref_axis = k;
  f.ref_positive = p.ta[k] >= 0;
  const float side = f.ref_positive ? 1.0f : -1.0f;
  f.hx = p.ha[k1];
  f.hy = p.ha[k2];

  const int j = largest(p.q[k]);
  const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
  f.inc_axis = j;
  f.inc_positive = side * p.r[k][j] < 0;
  const float h = f.inc_positive ? p.hb[j] : -p.hb[j];
  const auto column = [&](int c, float s) { return Vec3{s * p.r[k1][c], s * p.r[k2][c], s * side * p.r[k][c]}; };
  f.centre = Vec3{p.ta[k1], p.ta[k2], side * p.ta[k] - p.ha[k]} + column(j, h);
  f.u = column(j1, p.hb[j1]);
  f.v = column(j2, p.hb[j2]);
  return f;
}

FATHOM_HD std::uint32_t incident_vertex(const BoxFacePair& f, bool u, bool v) {
  return vertex_feature(box_vertex(f.inc_axis, f.inc_positive, u, v), !f.flipped);
}
FATHOM_HD std::uint32_t side_x_edge(const BoxFacePair& f, bool x) {
  return box_edge((f.ref_axis + 2) % 3, f.ref_positive, x);
}
FATHOM_HD std::uint32_t side_y_edge(const BoxFacePair& f, bool y) {
  return box_edge((f.ref_axis + 1) % 3, y, f.ref_positive);
}

/// Collects points that are not higher than `margin`.
struct FacePointList {
  FacePoint* points;
  int count;
  float margin;

  FATHOM_HD void add(float x, float y, float z, std::uint32_t feature) {
    if (z <= margin) points[count++] = {x, y, z, feature};
  }
};

/// 1/x, with zero replaced by a value too large to affect a cut.
FATHOM_HD float safe_reciprocal(float x) { return abs(x) > 1e-12f ? 1.0f / x : 1e12f; }

/// Clips the two incident edges base ± across + s·along, −1 ≤ s ≤ 1, against the rectangle hx, hy. Ends that lie inside
/// are vertices, which belong to two edges; only the edges along u report them.
template <bool along_u>
FATHOM_HD void cut_edges(const BoxFacePair& f, float hx, float hy, FacePointList& list) {
  const Vec3 along = along_u ? f.u : f.v, across = along_u ? f.v : f.u;
  const float rx = safe_reciprocal(along.x), ry = safe_reciprocal(along.y);
  const float wx = hx * abs(rx), wy = hy * abs(ry);
  for (int i = 0; i < 2; ++i) {
    const bool far_side = i == 1;
    const Vec3 base = far_side ? f.centre + across : f.centre - across;
    const float sx = -base.x * rx, sy = -base.y * ry;
    const float lo_x = sx - wx, lo_y = sy - wy, hi_x = sx + wx, hi_y = sy + wy;
    const float lo = max(-1.0f, max(lo_x, lo_y)), hi = min(1.0f, min(hi_x, hi_y));
    if (!(lo <= hi)) continue;

    const int axis = f.inc_axis;
    const std::uint32_t edge = along_u ? box_edge((axis + 1) % 3, far_side, f.inc_positive)
                                       : box_edge((axis + 2) % 3, f.inc_positive, far_side);
    const auto end = [&](float s, bool upper, bool cut_by_x) {
      const bool is_vertex = s == (upper ? 1.0f : -1.0f);
      if (is_vertex && !along_u) return;
      const Vec3 point = mul_add(base, s, along);
      // The upper cut is at the positive side if the edge runs in the positive direction.
      const std::uint32_t side =
          cut_by_x ? side_x_edge(f, upper == (along.x > 0)) : side_y_edge(f, upper == (along.y > 0));
      const std::uint32_t feature =
          is_vertex ? incident_vertex(f, upper, far_side) : edge_feature(side, edge, f.flipped);
      list.add(point.x, point.y, point.z, feature);
    };
    end(lo, false, lo_x > lo_y);
    end(hi, true, hi_x < hi_y);
  }
}

/// Corners of the rectangle inside the parallelogram.
FATHOM_HD void add_corners(const BoxFacePair& f, float hx, float hy, FacePointList& list) {
  const float det =
      f.u.x * f.v.y - f.u.y * f.v.x;  // never small: the incident face is the one most parallel to the reference face
  const float inv = 1.0f / det;
  for (int i = 0; i < 4; ++i) {
    const bool px = (i & 1) != 0, py = (i & 2) != 0;
    const float x = px ? hx : -hx, y = py ? hy : -hy;
    const float dx = x - f.centre.x, dy = y - f.centre.y;
    const float a = (dx * f.v.y - dy * f.v.x) * inv, b = (f.u.x * dy - f.u.y * dx) * inv;
    if (abs(a) < 1 && abs(b) < 1) {
      const float z = fma(b, f.v.z, fma(a, f.u.z, f.centre.z));
      list.add(x, y, z, vertex_feature(box_vertex(f.ref_axis, f.ref_positive, px, py), f.flipped));
    }
  }
}

inline constexpr int max_box_points = 12;  ///< four ends per pair of edges, four corners

/// Fills `points` (room for `max_box_points`) with the corners of the overlap; returns their number.
FATHOM_HD int clip_faces(const BoxFacePair& f, float side_tolerance, float margin, FacePoint* points) {
  FacePointList list{points, 0, margin};
  const float hx = f.hx + side_tolerance, hy = f.hy + side_tolerance;
  const bool inside =
      abs(f.centre.x) + abs(f.u.x) + abs(f.v.x) <= hx && abs(f.centre.y) + abs(f.u.y) + abs(f.v.y) <= hy;
  if (inside) {
    for (int i = 0; i < 4; ++i) {
      const bool pu = (i & 1) != 0, pv = (i & 2) != 0;
      const Vec3 edge = pv ? f.centre + f.v : f.centre - f.v;
      const Vec3 p = pu ? edge + f.u : edge - f.u;
      list.add(p.x, p.y, p.z, incident_vertex(f, pu, pv));
    }
  } else {
    cut_edges<true>(f, hx, hy, list);
    cut_edges<false>(f, hx, hy, list);
    add_corners(f, hx, hy, list);
  }
  return list.count;
}

}  // namespace fathom
