// Contact manifold of two boxes: the hot path of most scenes.
//
// Faces are preferred over edges and A's faces over B's, and the reference stays the same while it is within tolerance
// of the best: a resting contact must not flip between features from step to step (D. Gregorius, "Robust Contact
// Creation for Physics Simulations", GDC 2015).
#pragma once

#include "collision/box_axes.hpp"
#include "collision/box_clip.hpp"
#include "collision/cache.hpp"
#include "collision/strip.hpp"

namespace fathom {

/// One point where the two boxes' supporting edges along the axis cross.
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
  float a[3], b[3], d[3];  // midpoints of the edges, and the vector between them
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

/// Up to four points where the face of A across `axis` and the opposing face of B overlap. If the pair is swapped,
/// `unswapped` is the pair in its original order, in which the result is given; else null.
FATHOM_HD void box_face_contact(const BoxPair& p, int axis, const BoxPair* unswapped, float margin,
                                const PatchLoad& load, AxisCache& cache, Manifold& manifold) {
  const bool flipped = unswapped != nullptr;
  const BoxFacePair faces = make_face_pair(p, axis, flipped);
  FacePoint points[max_box_points];
  const int clipped = clip_faces(faces, p.tolerance.side, margin, points);
  // Axes of the reference face in the result's frame: its own, or its rows in the other box.
  const Lanes own[3] = {lanes(1, 0, 0), lanes(0, 1, 0), lanes(0, 0, 1)};
  const Lanes* axes = flipped ? p.r : own;
  const Lanes x = axes[(axis + 1) % 3], y = axes[(axis + 2) % 3], n = (faces.ref_positive ? 1.0f : -1.0f) * axes[axis];
  const Lanes middle = p.ha[axis] * n;
  const Lanes origin = flipped ? unswapped->ta + middle : middle;
  manifold.normal = vector(flipped ? -1.0f * n : n);
  cache.reduced = clipped > max_manifold_points;
  FaceLoad at;
  if (load.is_known && cache.reduced) {
    const Vec3 from_origin = load.at - vector(origin);
    at = {dot(from_origin, vector(x)), dot(from_origin, vector(y)), true};
  }
  manifold.count = reduce(points, clipped, p.tolerance.depth_tie, at);
  for (int i = 0; i < manifold.count; ++i) {
    const FacePoint& point = points[i];
    const Lanes position = origin + point.x * x + point.y * y + 0.5f * point.z * n;
    manifold.points[i] = {vector(position), point.z, point.feature};
  }
}

/// One point at the corner of B that is deepest under the face of A across `axis`. `unswapped` as above.
FATHOM_HD void box_vertex_contact(const BoxPair& p, int axis, const BoxPair* unswapped, Manifold& manifold) {
  const bool flipped = unswapped != nullptr;
  const float side = p.ta[axis] < 0 ? -1.0f : 1.0f;
  const bool upper[3] = {side * p.r[axis][0] < 0, side * p.r[axis][1] < 0, side * p.r[axis][2] < 0};
  float at[3];
  for (int c = 0; c < 3; ++c) {
    at[c] = p.ta[c];
    for (int k = 0; k < 3; ++k) at[c] = fma(upper[k] ? p.hb[k] : -p.hb[k], p.r[c][k], at[c]);
  }
  const float height = fma(side, at[axis], -p.ha[axis]);
  at[axis] = fma(-0.5f * side, height, at[axis]);
  const Lanes own[3] = {lanes(1, 0, 0), lanes(0, 1, 0), lanes(0, 0, 1)};
  const Lanes* axes = flipped ? p.r : own;
  const Lanes from_a = at[0] * axes[0] + at[1] * axes[1] + at[2] * axes[2];
  manifold.count = 1;
  manifold.normal = vector((flipped ? -side : side) * axes[axis]);
  manifold.points[0].position = vector(flipped ? unswapped->ta + from_a : from_a);
  manifold.points[0].separation = height;
  manifold.points[0].feature = vertex_feature(box_vertex(0, upper[0], upper[1], upper[2]), !flipped);
}

struct BoxFace {
  int axis;
  bool of_b;
};

/// The face to clip against: the best face of A, unless that of B is clearly better or the last step's is still good.
FATHOM_HD BoxFace reference_face(const BoxPair& p, BoxFace of_a, BoxFace of_b, const AxisCache& cache) {
  const float best_a = p.face_a[of_a.axis], best_b = p.face_b[of_b.axis];
  const float enough = max(best_a, best_b) - p.tolerance.axis;
  if (cache.kind == AxisCache::face_a && p.face_a[cache.a] > enough) return {cache.a, false};
  if (cache.kind == AxisCache::face_b && p.face_b[cache.b] > enough) return {cache.b, true};
  return best_b > best_a + p.tolerance.axis ? of_b : of_a;
}

/// Normal of a face that faces the other box, from A to B, in A's frame.
FATHOM_HD Vec3 normal_across(const BoxPair& p, BoxFace face) {
  const int axis = face.axis;
  if (face.of_b) return (p.tb[axis] < 0 ? -1.0f : 1.0f) * Vec3{p.r[0][axis], p.r[1][axis], p.r[2][axis]};
  const float sign = p.ta[axis] < 0 ? -1.0f : 1.0f;
  return {axis == 0 ? sign : 0, axis == 1 ? sign : 0, axis == 2 ? sign : 0};
}

/// See `collide`. The cache names axes 0 … 2 of the boxes for faces and for edges.
FATHOM_HD Manifold collide_boxes(Vec3 ha, Vec3 hb, const Pose& b_in_a, float margin, AxisCache& cache,
                                 const PatchLoad& load = {}) {
  Manifold manifold;
  const BoxPair pair = make_box_pair(ha, hb, b_in_a);
  const int axis_a = largest(pair.face_a), axis_b = largest(pair.face_b);
  const float face_a = pair.face_a[axis_a], face_b = pair.face_b[axis_b];
  if (face_a > margin) {
    cache = make_cache(AxisCache::face_a, axis_a, 0, true);
    return manifold;
  }
  if (face_b > margin) {
    cache = make_cache(AxisCache::face_b, 0, axis_b, true);
    return manifold;
  }
  if (cache.separated && cache.kind == AxisCache::edges &&
      edge_separation(edge_axes(pair, cache.a), cache.b) > margin) {
    return manifold;
  }

  const float face = max(face_a, face_b), tolerance = pair.tolerance.axis;
  const float edge_threshold = face + (cache.kind == AxisCache::edges ? 0.5f * tolerance : tolerance);
  BoxEdges edges;
  if (any_edges_above(pair, min(edge_threshold, margin))) edges = best_edges(pair, min(edge_threshold, margin));
  if (edges.separation > margin) {
    cache = make_cache(AxisCache::edges, edges.i, edges.j, true);
    return manifold;
  }

  const BoxFace reference = reference_face(pair, {axis_a, false}, {axis_b, true}, cache);
  const bool by_edges = edges.separation > edge_threshold;
  if (by_edges) {
    cache = make_cache(AxisCache::edges, edges.i, edges.j, false);
    box_edge_contact(pair, edges.i, edges.j, margin, manifold);
    if (!may_be_strip(manifold, normal_across(pair, reference))) return manifold;
  } else {
    cache = reference.of_b ? make_cache(AxisCache::face_b, 0, reference.axis, false)
                           : make_cache(AxisCache::face_a, reference.axis, 0, false);
  }
  // Shared calls, as in `collide_hulls`.
  Manifold strip;
  AxisCache of_strip;
  const PatchLoad& known = by_edges ? PatchLoad{} : load;
  AxisCache& face_cache = by_edges ? of_strip : cache;
  Manifold& over_face = by_edges ? strip : manifold;
  if (reference.of_b) {
    box_face_contact(swapped(pair), reference.axis, &pair, margin, known, face_cache, over_face);
  } else {
    box_face_contact(pair, reference.axis, nullptr, margin, known, face_cache, over_face);
  }
  if (by_edges) {
    widen_to_strip(strip, margin, tolerance, manifold);
    return manifold;
  }
  if (hides_overlap(manifold, face, tolerance)) {
    // No edges are as near where a corner just touches a face, and rounding puts it above the face.
    const BoxEdges nearest = best_edges(pair, face - tolerance);
    if (nearest.i >= 0) {
      box_edge_contact(pair, nearest.i, nearest.j, margin, manifold);
    } else if (reference.of_b) {
      box_vertex_contact(swapped(pair), reference.axis, &pair, manifold);
    } else {
      box_vertex_contact(pair, reference.axis, nullptr, manifold);
    }
  }
  return manifold;
}

}  // namespace fathom
