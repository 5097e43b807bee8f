// Separating axes of two hulls: faces against vertices, and the edge pairs that remain after the Gauss map test.
//
// D. Gregorius, "The Separating Axis Test between Convex Polyhedra", GDC 2013: two edges form a face of the Minkowski
// difference, and so a candidate axis, only where the arcs between the normals of their faces cross on the sphere. Few
// of these axes are tried: some known points of a hull bound its height along all others (hull_bounds.hpp).
#pragma once

#include "collision/frame.hpp"
#include "collision/hull_bounds.hpp"
#include "collision/manifold.hpp"
#include "collision/support.hpp"
#include "collision/tolerance.hpp"

namespace fathom {

/// The deepest vertex of the other hull under a face of the reference hull, and its height over that face.
FATHOM_HD Support lowest_over(const HullView& ref, int face, const HullView& other, const Frame& other_in_ref) {
  const Hull::Plane plane = ref.planes[face];
  const Vec3 direction = transpose_mul(other_in_ref.rotation, plane.normal);
  const Support lowest = lowest_vertex(other, direction);
  return {lowest.vertex, lowest.height + plane_height(plane, other_in_ref.position)};
}
FATHOM_HD float face_separation(const HullView& ref, int face, const HullView& other, const Frame& other_in_ref) {
  return lowest_over(ref, face, other, other_in_ref).height;
}

/// The face of `ref` over which `other` is highest; the first of equals. Stops at a face over which `other` is higher
/// than `margin`.
///
/// A hull is nowhere higher than any of its points, so its lowest vertex is needed over few faces: `start`, then
/// repeatedly the face over which the points found so far are highest. Rounding may make a hull `slack` (m) higher than
/// its points. The points are stored in `witnesses`.
FATHOM_HD FaceAxis best_face(const HullView& ref, const HullView& other, const Frame& other_in_ref, int start,
                             float slack, float margin, Witnesses& witnesses) {
  FaceAxis best;
  FaceHeights bounds(ref);
  for (int face = start;;) {
    const Support lowest = lowest_over(ref, face, other, other_in_ref);
    const bool is_best = lowest.height > best.separation || (lowest.height == best.separation && face < best.face);
    if (is_best) best = {face, lowest.height};
    if (lowest.height > margin) return best;
    bounds.close(ref, face);
    const Vec3 witness = transform(other_in_ref, other.vertices[lowest.vertex]);
    witnesses.add(witness);
    const FaceAxis next = bounds.lower(ref, witness);
    if (!(next.separation > no_separation && next.separation + slack >= best.separation)) return best;
    face = next.face;
  }
}

/// An edge of a hull with the normals of the faces beside it.
struct EdgeView {
  Vec3 from, along, left, right;
};
/// Undirected edge `k` of the hull.
FATHOM_HD EdgeView edge_view(const HullView& hull, int k) {
  const Hull::HalfEdge e = hull.edges[2 * k], twin = hull.edges[2 * k + 1];
  const Vec3 from = hull.vertices[e.origin];
  return {from, hull.vertices[twin.origin] - from, hull.planes[e.face].normal, hull.planes[twin.face].normal};
}
FATHOM_HD EdgeView transform(const Frame& f, const EdgeView& e) {
  return {transform(f, e.from), f.rotation * e.along, f.rotation * e.left, f.rotation * e.right};
}

/// Whether the arcs of normals of `a` and of the mirrored `b` cross. left × right runs along an edge, so no cross
/// products of the normals are needed.
FATHOM_HD bool makes_minkowski_face(const EdgeView& a, const EdgeView& b) {
  const float left_b = dot(b.left, a.along), right_b = dot(b.right, a.along);
  if (!(left_b * right_b < 0)) return false;
  const float left_a = dot(a.left, b.along), right_a = dot(a.right, b.along);
  return left_a * right_a < 0 && left_b * right_a < 0;
}

/// Two undirected edges and the axis across them, from A to B.
struct EdgesAxis {
  int a = -1, b = -1;
  float separation = no_separation;
  Vec3 normal;
};

/// Length of a cross product (m²) whose square still has full single precision; a shorter one defines no direction.
inline constexpr float min_cross = 1e-18f;

/// The rounding error `noise` (m) is subtracted before the division by the length of the cross product, as for boxes.
FATHOM_HD EdgesAxis edges_axis(const EdgeView& a, const EdgeView& b, float noise) {
  const Vec3 axis = cross(a.along, b.along);
  const float l = length(axis);
  if (!(l > min_cross)) return {};
  const float sign = dot(axis, a.left + a.right) < 0 ? -1.0f : 1.0f;
  const float scaled_noise = noise * fathom::sqrt(length_squared(a.along) * length_squared(b.along));
  const float inv = 1.0f / l;
  return {0, 0, (sign * dot(axis, b.from - a.from) - scaled_noise) * inv, (sign * inv) * axis};
}

/// The best of all edge pairs offered.
struct BestEdges {
  EdgesAxis best;

  FATHOM_HD explicit BestEdges(float threshold) { best.separation = threshold; }
  /// Among equals the lowest numbers win, whatever the order.
  FATHOM_HD void offer(EdgesAxis axis, int a, int b) {
    const bool is_first = b < best.b || (b == best.b && a < best.a);
    if (axis.separation > best.separation || (axis.separation == best.separation && is_first))
      best = {a, b, axis.separation, axis.normal};
  }
};

#if defined(FATHOM_HAS_EIGHT)
/// Directions and normals of eight edges.
struct EdgeEight {
  EightVec3 along, left, right;

  /// `makes_minkowski_face` against `b`, a bit for each edge.
  FATHOM_HD unsigned making_minkowski_faces(const EdgeView& b) const {
    const Eight left_b = dot(eight(b.left), along), right_b = dot(eight(b.right), along);
    const Eight left_a = dot(left, eight(b.along)), right_a = dot(right, eight(b.along));
    const Eight zero = eight(0.0f);
    return bits((left_b * right_b < zero) & (left_a * right_a < zero) & (left_b * right_a < zero));
  }
};

/// Edges of A in blocks of eight; the last block may be partly empty.
#if defined(__CUDACC__)
struct EdgeEights {
  const HullView& hull;
  const NearEdges& edges;

  FATHOM_HD EdgeEights(const HullView& h, const NearEdges& e) : hull(h), edges(e) {}
  FATHOM_HD EdgeEight at(int first) const {
    const EdgeView e = edge_view(hull, edges.edges[lane_index(first, edges.count)]);
    return {eight(e.along), eight(e.left), eight(e.right)};
  }
};
#else
struct EdgeEights {
  struct Block {
    Hull::Eight along, left, right;
  };
  Block blocks[(max_edges + 7) / 8];

  EdgeEights(const HullView& hull, const NearEdges& edges) {
    const auto put = [](Hull::Eight& to, int lane, Vec3 v) { to.x[lane] = v.x, to.y[lane] = v.y, to.z[lane] = v.z; };
    for (int i = 0; i < edges.count; ++i) {
      const EdgeView edge = edge_view(hull, edges.edges[i]);
      Block& block = blocks[i / 8];
      put(block.along, i % 8, edge.along), put(block.left, i % 8, edge.left), put(block.right, i % 8, edge.right);
    }
  }
  EdgeEight at(int first) const {
    const Block& block = blocks[first / 8];
    return {vectors(block.along), vectors(block.left), vectors(block.right)};
  }
};
#endif

/// `best_edges` in blocks of eight.
FATHOM_HD EdgesAxis best_edges_by_eights(const HullView& a, const HullView& b, const Frame& b_in_a,
                                         const NearEdges& near_a, const NearEdges& near_b, float noise, float threshold,
                                         float margin) {
  BestEdges found(threshold);
  const EdgeEights eights(a, near_a);
  for (int j = 0; j < near_b.count; ++j) {
    const EdgeView edge_b = transform(b_in_a, edge_view(b, near_b.edges[j]));
    for (int i = 0; i < near_a.count; i += 8) {
      const unsigned there = near_a.count - i < 8 ? (1u << (near_a.count - i)) - 1 : 0xffu;
      for (unsigned left = eights.at(i).making_minkowski_faces(edge_b) & there; left != 0; left &= left - 1) {
        const int edge_a = near_a.edges[i + lowest_bit(left)];
        found.offer(edges_axis(edge_view(a, edge_a), edge_b, noise), edge_a, near_b.edges[j]);
        if (found.best.separation > margin) return found.best;
      }
    }
  }
  return found.best;
}
#endif

/// The pair among these edges with the largest separation above `threshold`, if any. Ends early if that exceeds
/// `margin`.
FATHOM_HD EdgesAxis best_edges(const HullView& a, const HullView& b, const Frame& b_in_a, const NearEdges& near_a,
                               const NearEdges& near_b, float noise, float threshold, float margin) {
#if defined(FATHOM_HAS_EIGHT)
  if (by_eights(a)) return best_edges_by_eights(a, b, b_in_a, near_a, near_b, noise, threshold, margin);
#endif
  BestEdges found(threshold);
  for (int j = 0; j < near_b.count; ++j) {
    const EdgeView edge_b = transform(b_in_a, edge_view(b, near_b.edges[j]));
    for (int i = 0; i < near_a.count; ++i) {
      const EdgeView edge_a = edge_view(a, near_a.edges[i]);
      if (!makes_minkowski_face(edge_a, edge_b)) continue;
      found.offer(edges_axis(edge_a, edge_b, noise), near_a.edges[i], near_b.edges[j]);
      if (found.best.separation > margin) return found.best;
    }
  }
  return found.best;
}

/// Separation along the cached axis. Its edges need not form a Minkowski face: the axis across them shows as well as
/// any other that the hulls are apart.
FATHOM_HD float cached_separation(const HullView& a, const HullView& b, const Frame& b_in_a, const Frame& a_in_b,
                                  float noise, const AxisCache& cache) {
  if (cache.kind == AxisCache::face_a)
    return cache.a < a.face_count ? face_separation(a, cache.a, b, b_in_a) : no_separation;
  if (cache.kind == AxisCache::face_b)
    return cache.b < b.face_count ? face_separation(b, cache.b, a, a_in_b) : no_separation;
  if (2 * cache.a >= a.edge_count || 2 * cache.b >= b.edge_count) return no_separation;
  const EdgesAxis axis = edges_axis(edge_view(a, cache.a), transform(b_in_a, edge_view(b, cache.b)), noise);
  if (!(axis.separation > no_separation)) return no_separation;
  const float highest_of_a = highest_vertex(a, axis.normal).height;
  const float lowest_of_b = lowest_vertex(b, transpose_mul(b_in_a.rotation, axis.normal)).height;
  return lowest_of_b + dot(axis.normal, b_in_a.position) - highest_of_a;
}

}  // namespace fathom
