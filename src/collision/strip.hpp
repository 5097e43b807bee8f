// Edges that nearly lie in a face: a contact with several points.
//
// Where edges cross, the axis between them is often the best one although both nearly lie in the other shape's face:
// for example when a box leans with its side on another's edge. The shapes then touch along a strip, and a single point
// where the edges cross ignores that the strip's ends are about to meet. The body turns about that point until a face
// is the best axis, is pushed back there, and so on: it never comes to rest. The contact therefore uses the points over
// the face, along the edges' normal.
#pragma once

#include "collision/manifold.hpp"

namespace fathom {

/// Cosine of the largest angle between the edges' normal and the face's.
inline constexpr float min_strip_cosine = 0.94f;

/// Whether an edge contact may be a strip; normals have unit length.
FATHOM_HD bool may_be_strip(const Manifold& edges, Vec3 normal_of_face) {
  return edges.count > 0 && dot(edges.normal, normal_of_face) > min_strip_cosine;
}

/// Replaces the point of the contact `edges` by those of `over_face`, keeping its normal, if the deepest of these is as
/// deep as the edges within `tolerance` (m), and another one is at most `margin` (m) apart along that normal.
FATHOM_HD void widen_to_strip(const Manifold& over_face, float margin, float tolerance, Manifold& edges) {
  const float cosine = dot(over_face.normal, edges.normal);  // for coincident centres it may be the opposite face
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
