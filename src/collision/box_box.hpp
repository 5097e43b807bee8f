// Contact manifold of two boxes: the hot path of most scenes.
//
// Faces are preferred over edges and A's faces over B's, and what was the reference stays it while it is within
// tolerance of the best: a resting contact must not change its mind from step to step
// (D. Gregorius, "Robust Contact Creation for Physics Simulations", GDC 2015).
#pragma once

#include "collision/box_axes.hpp"
#include "collision/box_clip.hpp"
#include "collision/cache.hpp"

namespace fathom {

/// A pair of edge directions and the separation along their cross product.
struct BoxEdges {
  int i = -1, j = -1;
  float separation = -3e38f;
};

/// Separation along the axis that the cache names.
FATHOM_HD float cached_separation(const BoxPair& pair, const AxisCache& cache) {
  if (cache.kind == AxisCache::face_a) return face_a_separation(pair, cache.a);
  if (cache.kind == AxisCache::face_b) return face_b_separation(pair, cache.b);
  return separation(edge_axis(pair, cache.a, cache.b));
}

/// The edge axis with the largest separation above `threshold`, if any.
FATHOM_HD BoxEdges best_edges(const BoxPair& pair, float threshold) {
  BoxEdges best;
  float to_beat = signed_square(threshold);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const EdgeAxis axis = edge_axis(pair, i, j);
      if (signed_square(axis.scaled) > to_beat * axis.length_squared) {
        best = {i, j, separation(axis)};
        to_beat = signed_square(best.separation);
      }
    }
  }
  return best;
}

/// One point where the supporting edges of both boxes along the axis pass each other.
FATHOM_HD void box_edge_contact(const BoxPair& p, int i, int j, float margin, Manifold& manifold) {
  const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
  const float gap = p.ta[i2] * p.r[i1][j] - p.ta[i1] * p.r[i2][j];
  const float length_squared = fma(p.r[i1][j], p.r[i1][j], p.r[i2][j] * p.r[i2][j]);
  const float scale = (gap < 0 ? -1.0f : 1.0f) / fathom::sqrt(length_squared);

  float n[3];
  n[i] = 0;
  n[i1] = -scale * p.r[i2][j];
  n[i2] = scale * p.r[i1][j];
  const auto along_b = [&](int c) { return fma(n[i2], p.r[i2][c], n[i1] * p.r[i1][c]); };

  const bool a1 = n[i1] > 0, a2 = n[i2] > 0, b1 = along_b(j1) < 0, b2 = along_b(j2) < 0;
  float a[3], b[3], d[3];  // middles of the edges, and from one to the other
  a[i] = 0;
  a[i1] = a1 ? p.ha[i1] : -p.ha[i1];
  a[i2] = a2 ? p.ha[i2] : -p.ha[i2];
  const float b_1 = b1 ? p.hb[j1] : -p.hb[j1], b_2 = b2 ? p.hb[j2] : -p.hb[j2];
  for (int c = 0; c < 3; ++c) {
    b[c] = fma(b_2, p.r[c][j2], fma(b_1, p.r[c][j1], p.ta[c]));
    d[c] = b[c] - a[c];
  }
  const float cosine = p.r[i][j];
  const float d_b = fma(d[2], p.r[2][j], fma(d[1], p.r[1][j], d[0] * p.r[0][j]));
  const float x = clamp((d[i] - cosine * d_b) / length_squared, -p.ha[i], p.ha[i]);
  const float y = clamp((cosine * d[i] - d_b) / length_squared, -p.hb[j], p.hb[j]);
  a[i] += x;
  for (int c = 0; c < 3; ++c) b[c] = fma(y, p.r[c][j], b[c]);

  const float separation = fma(n[i2], d[i2], n[i1] * d[i1]);
  const Vec3 on_a{a[0], a[1], a[2]}, on_b{b[0], b[1], b[2]};
  // Ends of edges may be farther apart than the planes between them.
  if (separation > 0 && fathom::length_squared(on_b - on_a) > margin * margin) return;
  manifold.normal = {n[0], n[1], n[2]};
  manifold.count = 1;
  manifold.points[0].position = 0.5f * (on_a + on_b);
  manifold.points[0].separation = separation;
  manifold.points[0].feature = edge_feature(box_edge(i, a1, a2), box_edge(j, b1, b2), false);
}

/// Up to four points where the face `axis` of the reference box and the face of the other one that looks at it overlap.
FATHOM_HD void box_face_contact(const BoxPair& p, int axis, bool flipped, float margin, Manifold& manifold) {
  const BoxFacePair faces = make_face_pair(p, axis, flipped);
  FacePoint points[max_box_points];
  const int clipped = clip_faces(faces, p.tolerance.side, margin, points);
  manifold.count = reduce(points, clipped, p.tolerance.depth_tie);

  const int k1 = (axis + 1) % 3, k2 = (axis + 2) % 3;
  const float side = faces.ref_positive ? 1.0f : -1.0f;
  const float height = flipped ? p.hb[axis] : p.ha[axis];
  const auto to_a = [&](const float(&v)[3]) {
    if (!flipped) return Vec3{v[0], v[1], v[2]};
    const auto row = [&](int i) { return fma(p.r[i][2], v[2], fma(p.r[i][1], v[1], p.r[i][0] * v[0])); };
    return Vec3{row(0), row(1), row(2)};
  };
  for (int i = 0; i < manifold.count; ++i) {
    float v[3];
    v[axis] = side * fma(0.5f, points[i].z, height);
    v[k1] = points[i].x;
    v[k2] = points[i].y;
    const Vec3 position = to_a(v);
    manifold.points[i].position = flipped ? position + Vec3{p.ta[0], p.ta[1], p.ta[2]} : position;
    manifold.points[i].separation = points[i].z;
    manifold.points[i].feature = points[i].feature;
  }
  float n[3] = {0, 0, 0};
  n[axis] = flipped ? -side : side;
  manifold.normal = to_a(n);
}

/// See `collide`. The cache names axes 0 … 2 of the boxes for faces and for edges.
FATHOM_HD Manifold collide_boxes(Vec3 ha, Vec3 hb, const Pose& b_in_a, float margin, AxisCache& cache) {
  Manifold manifold;
  const BoxPair pair = make_box_pair(ha, hb, b_in_a);
  if (cache.separated && cached_separation(pair, cache) > margin) return manifold;

  int axis_a = 0, axis_b = 0;
  float face_a = face_a_separation(pair, 0), face_b = face_b_separation(pair, 0);
  for (int k = 1; k < 3; ++k) {
    const float s_a = face_a_separation(pair, k), s_b = face_b_separation(pair, k);
    if (s_a > face_a) face_a = s_a, axis_a = k;
    if (s_b > face_b) face_b = s_b, axis_b = k;
  }
  if (face_a > margin) {
    cache = make_cache(AxisCache::face_a, axis_a, 0, true);
    return manifold;
  }
  if (face_b > margin) {
    cache = make_cache(AxisCache::face_b, 0, axis_b, true);
    return manifold;
  }

  const float face = max(face_a, face_b), tolerance = pair.tolerance.axis;
  const float edge_threshold = face + (cache.kind == AxisCache::edges ? 0.5f * tolerance : tolerance);
  const BoxEdges edges = best_edges(pair, min(edge_threshold, margin));
  if (edges.separation > margin) {
    cache = make_cache(AxisCache::edges, edges.i, edges.j, true);
    return manifold;
  }
  if (edges.separation > edge_threshold) {
    cache = make_cache(AxisCache::edges, edges.i, edges.j, false);
    box_edge_contact(pair, edges.i, edges.j, margin, manifold);
    return manifold;
  }

  bool flipped = face_b > face_a + tolerance;
  int axis = flipped ? axis_b : axis_a;
  const bool cached_face = cache.kind == AxisCache::face_a || cache.kind == AxisCache::face_b;
  if (cached_face && cached_separation(pair, cache) + tolerance > face) {
    flipped = cache.kind == AxisCache::face_b;
    axis = flipped ? cache.b : cache.a;
  }
  cache = flipped ? make_cache(AxisCache::face_b, 0, axis, false) : make_cache(AxisCache::face_a, axis, 0, false);
  box_face_contact(pair, axis, flipped, margin, manifold);
  if (manifold.count == 0 && face <= 0) {
    // Overlapping, yet not over this face: edges within the tolerance of it are what touches.
    const BoxEdges nearest = best_edges(pair, -3e18f);
    if (nearest.i >= 0) box_edge_contact(pair, nearest.i, nearest.j, margin, manifold);
  }
  return manifold;
}

}  // namespace fathom
