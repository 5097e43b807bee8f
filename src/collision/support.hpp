// Support functions: how far a shape reaches in a direction.
#pragma once

#include "geometry/geometry.hpp"

namespace fathom {

/// A vertex and its height along the direction that was asked for.
struct Support {
  int vertex;
  float height;
};

/// The vertex of the hull with the least height along `direction`, the first of equals.
FATHOM_HD Support lowest_vertex(const HullView& hull, Vec3 direction) {
  Support best{0, dot(direction, hull.vertices[0])};
  for (int i = 1; i < hull.vertex_count; ++i) {
    const float height = dot(direction, hull.vertices[i]);
    if (height < best.height) best = {i, height};
  }
  return best;
}

FATHOM_HD Support highest_vertex(const HullView& hull, Vec3 direction) {
  const Support s = lowest_vertex(hull, -direction);
  return {s.vertex, -s.height};
}

FATHOM_HD float plane_height(const Hull::Plane& plane, Vec3 point) { return dot(plane.normal, point) - plane.offset; }

/// Least distance of a face from the origin (m) and bound on the vertices' coordinates (m).
struct HullSize {
  float inner, outer;
};
FATHOM_HD HullSize size_of(const HullView& hull) {
  HullSize size{hull.planes[0].offset, 0};
  for (int i = 1; i < hull.face_count; ++i) size.inner = min(size.inner, hull.planes[i].offset);
  for (int i = 0; i < hull.vertex_count; ++i) size.outer = max(size.outer, max_component(abs(hull.vertices[i])));
  return size;
}

}  // namespace fathom
