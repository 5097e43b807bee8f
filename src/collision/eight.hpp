// Eight vertices or planes of a hull side by side (math/eight.hpp).
#pragma once

#include "geometry/geometry.hpp"
#include "math/eight.hpp"

#if defined(FATHOM_HAS_EIGHT)

namespace fathom {

/// Eight vertices or planes of a hull, starting at number `first`, a multiple of eight; missing ones in the last eight
/// are filled with number 0.
#if defined(__CUDACC__)
FATHOM_HD int lane_index(int first, int count) {
  const int i = first + lane_numbers().lane;
  return i < count ? i : 0;
}
FATHOM_HD EightVec3 vertices_at(const HullView& hull, int first) {
  return eight(hull.vertices[lane_index(first, hull.vertex_count)]);
}
FATHOM_HD EightPlanes planes_at(const HullView& hull, int first) {
  const Hull::Plane plane = hull.planes[lane_index(first, hull.face_count)];
  return {eight(plane.normal), eight(plane.offset)};
}
#else
inline EightVec3 vectors(const Hull::Eight& block) { return {eight(block.x), eight(block.y), eight(block.z)}; }
inline EightVec3 vertices_at(const HullView& hull, int first) { return vectors(hull.vertex_eights[first / 8]); }
inline EightPlanes planes_at(const HullView& hull, int first) {
  const Hull::Eight& block = hull.plane_eights[first / 8];
  return {vectors(block), eight(block.w)};
}
#endif

}  // namespace fathom

#endif

namespace fathom {

/// Whether this hull is searched in blocks of eight: where it has them, or for a team.
FATHOM_HD bool by_eights(const HullView& hull) {
#if defined(__CUDACC__)
  return hull.is_for_team;
#elif defined(FATHOM_HAS_EIGHT)
  return hull.plane_eights != nullptr;
#else
  (void)hull;
  return false;
#endif
}

}  // namespace fathom
