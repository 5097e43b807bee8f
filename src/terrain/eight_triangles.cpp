#include "terrain/eight_triangles.hpp"

#include <cmath>

#include "terrain/triangle_lanes.hpp"

namespace fathom {
namespace {

typedef double Four __attribute__((vector_size(32)));
typedef float FourFloats __attribute__((vector_size(16)));

struct FourVec3 {
  Four x, y, z;
};
FourVec3 operator-(const FourVec3& a, const FourVec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }

Four sqrt(Four a) {
#if defined(__FMA__)
  return (Four)_mm256_sqrt_pd((__m256d)a);
#else
  for (int i = 0; i < 4; ++i) a[i] = std::sqrt(a[i]);
  return a;
#endif
}

Four to_double(const float* four) {
  FourFloats floats;
  std::memcpy(&floats, four, sizeof floats);
  return __builtin_convertvector(floats, Four);
}
FourVec3 to_double(const Hull::Eight& eight, int first) {
  return {to_double(eight.x + first), to_double(eight.y + first), to_double(eight.z + first)};
}
void store(Four from, float* to) {
  const FourFloats floats = __builtin_convertvector(from, FourFloats);
  std::memcpy(to, &floats, sizeof floats);
}

/// Unit normals of the four triangles from `first` on. In double precision, as for one triangle.
void set_normals(const Hull::Eight (&corners)[3], int first, Hull::Eight& planes) {
  const FourVec3 a = to_double(corners[0], first);
  const FourVec3 b = to_double(corners[1], first) - a, c = to_double(corners[2], first) - a;
  const FourVec3 n{b.y * c.z - b.z * c.y, b.z * c.x - b.x * c.z, b.x * c.y - b.y * c.x};
  const Four scale = 1.0 / sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
  store(scale * n.x, planes.x + first), store(scale * n.y, planes.y + first), store(scale * n.z, planes.z + first);
}

}  // namespace

void EightTriangles::complete(Vec3 origin) {
  // Lanes without a triangle repeat the first one: they would be NaN.
  for (int lane = count; lane < 8; ++lane)
    for (Hull::Eight& corner : corners)
      corner.x[lane] = corner.x[0], corner.y[lane] = corner.y[0], corner.z[lane] = corner.z[0];
  set_normals(corners, 0, planes), set_normals(corners, 4, planes);
  const EightVec3 from = eight(origin);
  for (Hull::Eight& corner : corners) {
    const EightVec3 relative = vectors(corner) - from;
    eight_at(corner.x, 0) = relative.x, eight_at(corner.y, 0) = relative.y, eight_at(corner.z, 0) = relative.z;
  }
  eight_at(planes.w, 0) = dot(vectors(planes), vectors(corners[0]));
}

}  // namespace fathom
