// Vectors in double precision, for computations outside the step: hulls, mass properties, eigenvalues, queries.
#pragma once

#include <cmath>
#include <fathom/math.hpp>

namespace fathom {

struct Vec3d {
  double x = 0, y = 0, z = 0;
};

FATHOM_HD Vec3d operator+(Vec3d a, Vec3d b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
FATHOM_HD Vec3d operator-(Vec3d a, Vec3d b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
FATHOM_HD Vec3d operator-(Vec3d a) { return {-a.x, -a.y, -a.z}; }
FATHOM_HD Vec3d operator*(double s, Vec3d a) { return {s * a.x, s * a.y, s * a.z}; }
FATHOM_HD Vec3d& operator+=(Vec3d& a, Vec3d b) { return a = a + b; }
FATHOM_HD double dot(Vec3d a, Vec3d b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
FATHOM_HD Vec3d cross(Vec3d a, Vec3d b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
FATHOM_HD double length(Vec3d a) { return std::sqrt(dot(a, a)); }

FATHOM_HD double to_double(float a) { return static_cast<double>(a); }
FATHOM_HD Vec3d to_double(Vec3 a) { return {to_double(a.x), to_double(a.y), to_double(a.z)}; }
FATHOM_HD Vec3 to_float(Vec3d a) { return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)}; }

}  // namespace fathom
