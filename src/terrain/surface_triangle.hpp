// A triangle of a surface relative to the centre of a convex shape, so that surfaces of kilometres cost no precision.
// For host and device.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>
#include <fathom/mesh.hpp>

#include "math/vec3d.hpp"

namespace fathom {

struct SurfaceTriangle {
  Vec3 corners[3];         ///< m, counter-clockwise seen from outside
  Vec3 normal;             ///< unit, outward
  float offset;            ///< m, offset of its plane along the normal
  std::uint32_t names[3];  ///< of its corners

  SurfaceTriangle() = default;
  /// `origin`: the other shape's position in the surface's frame.
  FATHOM_HD SurfaceTriangle(const Triangle& triangle, Vec3 origin) {
    for (int k = 0; k < 3; ++k) corners[k] = triangle.corners[k] - origin, names[k] = triangle.vertices[k];
    // In double precision: triangles may be a kilometre long and a millimetre wide.
    const Vec3d a = to_double(triangle.corners[0]);
    const Vec3d n = cross(to_double(triangle.corners[1]) - a, to_double(triangle.corners[2]) - a);
    normal = to_float((1 / fathom::length(n)) * n);
    offset = dot(normal, corners[0]);
  }
};

/// The triangle in axes that are turned by `rotation` in its own.
FATHOM_HD SurfaceTriangle in_axes(Quat rotation, SurfaceTriangle t) {
  for (Vec3& corner : t.corners) corner = inverse_rotate(rotation, corner);
  t.normal = inverse_rotate(rotation, t.normal);
  return t;
}

}  // namespace fathom
