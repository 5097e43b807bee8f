// Bounds of shapes, eight vertices of a hull at a time. For the host only.
#pragma once

#include "collision/eight.hpp"
#include "geometry/support.hpp"
#include "math/eight_rows.hpp"

namespace fathom::native {

/// The same bits as `fathom::bounds`.
inline Aabb quick_bounds(const Geometry& shape, const Pose& pose) {
  if (shape.type != ShapeType::hull || !shape.hull.vertex_eights) return bounds(shape, pose);
  const Mat3 m = to_matrix(pose.rotation);
  // Lower bounds along the axes, and negated upper ones; the last two are not used.
  Eight least[8];
  for (Eight& of : least) of = eight(3e38f);
  for (int first = 0; first < shape.hull.vertex_count; first += 8) {
    const EightVec3 v = vertices_at(shape.hull, first);
    for (int axis = 0; axis < 3; ++axis) {
      const Eight at = fma(v.z, eight(m.z[axis]), fma(v.y, eight(m.y[axis]), v.x * eight(m.x[axis])));
      least[axis] = min(at, least[axis]);
      least[3 + axis] = min(-at, least[3 + axis]);
    }
  }
  transpose(least);
  Eight of_all = least[0];
  for (int lane = 1; lane < 8; ++lane) of_all = min(least[lane], of_all);
  const Vec3 r{shape.radius, shape.radius, shape.radius}, lower{of_all[0], of_all[1], of_all[2]};
  const Vec3 upper{-of_all[3], -of_all[4], -of_all[5]};
  return {pose.position + (lower - r), pose.position + (upper + r)};
}

}  // namespace fathom::native
