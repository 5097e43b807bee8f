// Support functions: how far a shape reaches in a direction.
#pragma once

#include "collision/eight.hpp"
#include "geometry/geometry.hpp"

namespace fathom {

/// A vertex and its height along the given direction.
struct Support {
  int vertex;
  float height;
};

#if defined(FATHOM_HAS_EIGHT)
/// The lowest of `number` vectors along `direction`, the first of equals; `vectors(i)` returns eight from number i on.
template <class Vectors>
FATHOM_HD Support lowest_of_eights(int number, Vec3 direction, const Vectors& vectors) {
  const EightVec3 along = eight(direction);
  const EightInts count = lane_numbers();
  Eight lowest = dot(along, vectors(0));
  EightInts vertex = count;
  for (int i = 8; i < number; i += 8) {
    const Eight height = dot(along, vectors(i));
    const EightInts lower = height < lowest;
    lowest = select(lower, height, lowest);
    vertex = select(lower, count + i, vertex);
  }
  const LeastLane least = min_lane(lowest, vertex);
  return {least.index, least.value + 0.0f};  // turns −0 into +0: among zeros the lanes may pick either sign
}
#endif

/// The hull's lowest vertex along `direction`; the first of equals.
FATHOM_HD Support lowest_vertex(const HullView& hull, Vec3 direction) {
#if defined(FATHOM_HAS_EIGHT)
  if (by_eights(hull))
    return lowest_of_eights(hull.vertex_count, direction, [&](int i) { return vertices_at(hull, i); });
#endif
  Support best{0, dot(direction, hull.vertices[0])};
  for (int i = 1; i < hull.vertex_count; ++i) {
    const float height = dot(direction, hull.vertices[i]);
    if (height < best.height) best = {i, height};
  }
  best.height += 0.0f;
  return best;
}

FATHOM_HD Support highest_vertex(const HullView& hull, Vec3 direction) {
  const Support s = lowest_vertex(hull, -direction);
  return {s.vertex, -s.height};
}

FATHOM_HD float plane_height(const Hull::Plane& plane, Vec3 point) { return dot(plane.normal, point) - plane.offset; }

/// The face whose normal is most aligned with `direction`; the first of equals.
FATHOM_HD int facing(const HullView& hull, Vec3 direction) {
#if defined(FATHOM_HAS_EIGHT)
  if (by_eights(hull))
    return lowest_of_eights(hull.face_count, -direction, [&](int i) { return planes_at(hull, i).normals; }).vertex;
#endif
  int best = 0;
  float highest = dot(direction, hull.planes[0].normal);
  for (int f = 1; f < hull.face_count; ++f) {
    const float height = dot(direction, hull.planes[f].normal);
    if (height > highest) best = f, highest = height;
  }
  return best;
}

/// Least distance of a face from the origin (m) and bound on the vertices' coordinates (m).
struct HullSize {
  float inner, outer;
};
FATHOM_HD HullSize size_of(const HullView& hull) {
  if (hull.outer > 0) return {hull.inner, hull.outer};
  HullSize size{hull.planes[0].offset, 0};
  for (int i = 1; i < hull.face_count; ++i) size.inner = min(size.inner, hull.planes[i].offset);
  for (int i = 0; i < hull.vertex_count; ++i) size.outer = max(size.outer, max_component(abs(hull.vertices[i])));
  return size;
}

}  // namespace fathom
