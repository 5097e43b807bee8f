// Separating axes of two hulls: all faces against all vertices, and the edge pairs that the Gauss map leaves.
//
// D. Gregorius, "The Separating Axis Test between Convex Polyhedra", GDC 2013: two edges make a face of the Minkowski
// difference, and so a candidate axis, only where the arcs between the normals of their faces cross on the sphere.
#pragma once

#include "collision/frame.hpp"
#include "collision/manifold.hpp"
#include "collision/support.hpp"
#include "collision/tolerance.hpp"

namespace fathom {

inline constexpr float no_separation = -3e38f;

struct FaceAxis {
  int face = 0;
  float separation = no_separation;
};

/// Height of the other hull over a face of the reference hull.
FATHOM_HD float face_separation(const HullView& ref, int face, const HullView& other, const Frame& other_in_ref) {
  const Hull::Plane plane = ref.planes[face];
  const Vec3 direction = transpose_mul(other_in_ref.rotation, plane.normal);
  return lowest_vertex(other, direction).height + plane_height(plane, other_in_ref.position);
}

/// The face of `ref` that `other` is highest over. Ends early where that is more than `margin`.
FATHOM_HD FaceAxis best_face(const HullView& ref, const HullView& other, const Frame& other_in_ref, float margin) {
  FaceAxis best;
  for (int f = 0; f < ref.face_count; ++f) {
    const float separation = face_separation(ref, f, other, other_in_ref);
    if (separation > best.separation) best = {f, separation};
    if (separation > margin) break;
  }
  return best;
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

/// Do the arcs of normals of `a` and of the mirrored `b` cross? left × right runs along an edge, which saves the
/// cross products of the normals.
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

/// Length of a cross product (m²) whose square single precision still holds with all its digits; a shorter one tells no
/// direction.
inline constexpr float least_cross = 1e-18f;

/// `noise` (m) of rounding is taken off before the division by the length of the cross product, as for boxes.
FATHOM_HD EdgesAxis edges_axis(const EdgeView& a, const EdgeView& b, float noise) {
  const Vec3 axis = cross(a.along, b.along);
  const float l = length(axis);
  if (!(l > least_cross)) return {};
  const float sign = dot(axis, a.left + a.right) < 0 ? -1.0f : 1.0f;
  const float scaled_noise = noise * fathom::sqrt(length_squared(a.along) * length_squared(b.along));
  const float inv = 1.0f / l;
  return {0, 0, (sign * dot(axis, b.from - a.from) - scaled_noise) * inv, (sign * inv) * axis};
}

/// The pair of edges with the largest separation. Ends early where that is more than `margin`.
FATHOM_HD EdgesAxis best_edges(const HullView& a, const HullView& b, const Frame& b_in_a, float noise, float margin) {
  EdgesAxis best;
  for (int j = 0; 2 * j < b.edge_count; ++j) {
    const EdgeView edge_b = transform(b_in_a, edge_view(b, j));
    for (int i = 0; 2 * i < a.edge_count; ++i) {
      const EdgeView edge_a = edge_view(a, i);
      if (!makes_minkowski_face(edge_a, edge_b)) continue;
      EdgesAxis axis = edges_axis(edge_a, edge_b, noise);
      if (axis.separation > best.separation) best = {i, j, axis.separation, axis.normal};
      if (best.separation > margin) return best;
    }
  }
  return best;
}

/// Separation along the axis that the cache names. Edges need not make a Minkowski face any more: the axis across them
/// is as good as any other to show that the hulls are apart.
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
