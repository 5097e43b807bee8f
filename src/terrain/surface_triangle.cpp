#include "terrain/surface_triangle.hpp"

#include "math/vec3d.hpp"

namespace fathom {

SurfaceTriangle::SurfaceTriangle(const Triangle& triangle, Vec3 origin) {
  for (int k = 0; k < 3; ++k) corners[k] = triangle.corners[k] - origin, names[k] = triangle.vertices[k];
  // In double precision: triangles may be a kilometre long and a millimetre wide.
  const Vec3d a = to_double(triangle.corners[0]);
  const Vec3d n = cross(to_double(triangle.corners[1]) - a, to_double(triangle.corners[2]) - a);
  normal = to_float((1 / fathom::length(n)) * n);
  offset = dot(normal, corners[0]);
}

}  // namespace fathom
