// The deepest point of a polyhedron among those that lie under a triangle. Pure, for host and device.
#pragma once

#include "collision/collide.hpp"
#include "terrain/surface_triangle.hpp"

namespace fathom {

struct PointUnder {
  Vec3 at;
  float height = 3e38f;  ///< m, over the triangle's plane; so high if there is none
  std::uint32_t feature = 0;
};

/// Of the part of `shape` whose projection along the normal lies in the triangle. It is where an edge of the shape ends
/// or passes a side of the triangle, or where the line under a corner leaves the shape. `shape` has the triangle's
/// axes.
FATHOM_HD PointUnder deepest_under(const SurfaceTriangle& t, const HullView& shape) {
  PointUnder deepest;
  const auto offer = [&](Vec3 at, std::uint32_t feature) {
    const float height = dot(t.normal, at) - t.offset;
    if (height < deepest.height) deepest = {at, height, feature};
  };
  Vec3 inward[3];
  for (int k = 0; k < 3; ++k) inward[k] = cross(t.normal, t.corners[(k + 1) % 3] - t.corners[k]);

  for (int e = 0; e < shape.edge_count / 2; ++e) {
    const EdgeView edge = edge_view(shape, e);
    float from = 0, to = 1;
    std::uint32_t side_from = 0, side_to = 0;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const float inside = dot(inward[k], edge.from - t.corners[k]), rate = dot(inward[k], edge.along);
      if (rate == 0) {
        if (inside < 0) to = -1;
        continue;
      }
      const float at = -inside / rate;
      if (rate > 0 && at > from) from = at, side_from = k;
      if (rate < 0 && at < to) to = at, side_to = k;
    }
    if (from > to) continue;
    const auto number = static_cast<std::uint32_t>(e);
    offer(mul_add(edge.from, from, edge.along), edge_feature(side_from, number, false));
    offer(mul_add(edge.from, to, edge.along), edge_feature(side_to, number, false));
  }
  for (std::uint32_t k = 0; k < 3; ++k) {
    float enters = -3e38f, leaves = 3e38f;  // depths (m)
    for (int f = 0; f < shape.face_count; ++f) {
      const float height = plane_height(shape.planes[f], t.corners[k]), rate = -dot(shape.planes[f].normal, t.normal);
      if (rate > 0) leaves = min(leaves, -height / rate);
      if (rate < 0) enters = max(enters, -height / rate);
      if (rate == 0 && height > 0) leaves = -3e38f;
    }
    if (enters <= leaves) offer(mul_add(t.corners[k], -leaves, t.normal), vertex_feature(k, false));
  }
  return deepest;
}

}  // namespace fathom
