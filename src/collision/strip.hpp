// Edges that nearly lie in a face: a contact of several points.
//
// Where edges cross, the axis between them is often the best one although both nearly lie in the other shape's face: a
// box that leans on another's edge by its own side. Then the shapes touch along a strip, and one point where the edges
// pass each other leaves out where its ends are about to meet. The body turns about that point until a face is the best
// axis, is pushed back there, and so on: it never comes to rest. So the points are those over the face, along the
// edges' normal.
#pragma once

#include "collision/manifold.hpp"

namespace fathom {

/// Cosine of the largest angle between the normals of such edges and of the face.
inline constexpr float min_strip_cosine = 0.94f;

/// Whether a contact of edges may be one; normals of unit length.
FATHOM_HD bool may_be_strip(const Manifold& edges, Vec3 normal_of_face) {
  return edges.count > 0 && dot(edges.normal, normal_of_face) > min_strip_cosine;
}

/// Puts the points `over_face` into the contact of two `edges`, whose normal stays, if the deepest of them is as deep
/// as the edges are, within `tolerance` (m), and another one is not farther than `margin` (m) along that normal.
FATHOM_HD void widen_to_strip(const Manifold& over_face, float margin, float tolerance, Manifold& edges) {
  const float cosine = dot(over_face.normal, edges.normal);  // where centres coincide the face may be the one opposite
  if (over_face.count == 0 || !(cosine > min_strip_cosine)) return;
  const float deeper = nearest_separation(over_face) / cosine - edges.points[0].separation;
  if (!(abs(deeper) <= tolerance)) return;
  Manifold strip;
  for (int i = 0; i < max_manifold_points; ++i) {
    if (i >= over_face.count) continue;
    const ManifoldPoint& point = over_face.points[i];
    const float separation = point.separation / cosine;
    if (separation > margin) continue;
    const Vec3 on_b = mul_add(point.position, 0.5f * point.separation, over_face.normal);
    strip.points[strip.count++] = {mul_add(on_b, -0.5f * separation, edges.normal), separation, point.feature};
  }
  if (strip.count < 2) return;
  edges.count = strip.count;
  for (int i = 0; i < max_manifold_points; ++i)
    if (i < strip.count) edges.points[i] = strip.points[i];
}

}  // namespace fathom
