// Seams between surfaces, and between surfaces and solids beside them (collision/seam.hpp). Pure, for host and device.
#pragma once

#include "collision/seam.hpp"
#include "terrain/surface_triangle.hpp"

namespace fathom {

inline constexpr float max_slope = 0.7f;  ///< of a neighbour that continues the surface

/// A triangle of a surface, solid behind it down to `depth` (m).
struct NeighbourTriangle {
  SurfaceTriangle triangle;
  float depth;

  FATHOM_HD bool holds(Vec3 point, float gap) const {
    const float height = dot(triangle.normal, point) - triangle.offset;
    if (height > gap || height < -depth) return false;
    for (int k = 0; k < 3; ++k) {
      const Vec3 from = triangle.corners[k], along = triangle.corners[(k + 1) % 3] - from;
      const Vec3 outward = cross(along, triangle.normal);
      if (dot(outward, point - from) > gap * length(outward)) return false;
    }
    return true;
  }
  template <class Act>
  FATHOM_HD bool any_face_before(Vec3 point, const Act& act) const {
    return dot(triangle.normal, point) > triangle.offset && act(Hull::Plane{triangle.normal, triangle.offset});
  }
  FATHOM_HD float rise(Vec3 point, Vec3 normal) const {
    float highest = -3e38f;
    for (const Vec3& corner : triangle.corners) highest = max(highest, dot(normal, corner - point));
    return highest;
  }
};

/// The box around the manifold's points on A's surface.
FATHOM_HD Aabb around_patch(const Manifold& m, float distance) {
  Aabb box{on_first(m, 0), on_first(m, 0)};
  for (int i = 1; i < m.count; ++i) box = {min(box.lower, on_first(m, i)), max(box.upper, on_first(m, i))};
  return grown(box, distance);
}

/// Whether the neighbour continues where the surface with this normal ends, rising by less than 45°: then it is no
/// wall.
FATHOM_HD bool goes_on(const NeighbourSolid& neighbour, Vec3 point, Vec3 normal, float gap) {
  const Vec3 direction = inverse_rotate(neighbour.pose.rotation, normal);
  const Vec3 way = transform(neighbour.pose, support(neighbour.shape, direction)) - point;
  return dot(way, normal) <= max_slope * length(way) + gap;
}
FATHOM_HD bool goes_on(const NeighbourTriangle& neighbour, Vec3 point, Vec3 normal, float gap) {
  for (const Vec3& corner : neighbour.triangle.corners)
    if (!(dot(corner - point, normal) <= max_slope * length(corner - point) + gap)) return false;
  return true;
}

/// Whether the manifold `m` of a surface and a body with this centre touches where the body can touch the surface and
/// its neighbours together. `any_normal(box, act)` returns whether act(normal) is true for any of the surface's
/// triangles in the box.
template <class Neighbours, class AnyNormal>
FATHOM_HD bool counts_beside(const Neighbours& neighbours, const AnyNormal& any_normal, const SeamLengths& lengths,
                             Vec3 centre, const Manifold& m) {
  if (is_held(neighbours, centre)) return true;
  const Aabb around = around_patch(m, lengths.step);
  if (any_normal(around, [&](Vec3 n) { return dot(n, m.normal) > 1 - 1e-6f; })) return true;
  const auto is_hidden = [&](Vec3 point) {
    return neighbours.any([&](const auto& n) {
      return rises_at(n, point, m.normal, lengths.gap) &&
             any_normal(around, [&](Vec3 normal) { return goes_on(n, point, normal, lengths.gap); });
    });
  };
  // A face of the body may cover more of the surface than it touches.
  float farthest = -3e38f;
  for (int i = 0; i < m.count; ++i) farthest = max(farthest, dot(m.normal, on_first(m, i)));
  for (int i = 0; i < m.count; ++i)
    if (const Vec3 point = on_first(m, i); dot(m.normal, point) >= farthest - lengths.gap && !is_hidden(point))
      return true;
  return false;
}

/// The part of the manifold that counts: all of it, or the points that lie in a gap beside the surface, or none.
template <class Neighbours, class AnyNormal>
FATHOM_HD Manifold kept_beside(const Neighbours& neighbours, const AnyNormal& any_normal, const SeamLengths& lengths,
                               const Geometry& b, const Pose& b_in_a, const Manifold& m) {
  if (at_any_moment(neighbours,
                    [&](const auto& now) { return counts_beside(now, any_normal, lengths, b_in_a.position, m); }))
    return m;
  float nearest = 0;
  Vec3 face_normal;
  any_normal(around_patch(m, lengths.step), [&](Vec3 normal) {
    if (const float cosine = dot(normal, m.normal); cosine > nearest) nearest = cosine, face_normal = normal;
    return false;
  });
  return nearest > 0 ? turned_to_face(m, face_normal, b, b_in_a, lengths.gap) : Manifold{};
}

}  // namespace fathom
