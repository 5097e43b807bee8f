// Eight triangles side by side against a convex shape: shared by the axis searches.
#pragma once

#include "terrain/eight_triangles.hpp"
#include "terrain/triangle_axes-inl.hpp"

namespace fathom {

inline EightVec3 operator-(const EightVec3& a, const EightVec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline EightVec3 operator*(Eight s, const EightVec3& a) { return {s * a.x, s * a.y, s * a.z}; }
inline EightVec3 cross(const EightVec3& a, const EightVec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Eight length_squared(const EightVec3& a) { return dot(a, a); }

struct EightLanes {
  using Real = Eight;
  using Int = EightInts;
  using Vec = EightVec3;
  using Mask = EightInts;

  static Eight all(float x) { return eight(x); }
  static EightInts all(std::int32_t x) { return eight(x); }
  static EightVec3 all(Vec3 v) { return eight(v); }
  static bool any(EightInts m) { return bits(m) != 0; }
  static EightInts both(EightInts a, EightInts b) { return a & b; }
  static EightInts either(EightInts a, EightInts b) { return a | b; }
  static EightInts without(EightInts a, EightInts b) { return a & ~b; }
  static Eight select(EightInts m, Eight a, Eight b) { return fathom::select(m, a, b); }
  static EightInts select(EightInts m, EightInts a, EightInts b) { return fathom::select(m, a, b); }
  static EightVec3 negated_where(EightInts m, const EightVec3& a) {
    return {select(m, -a.x, a.x), select(m, -a.y, a.y), select(m, -a.z, a.z)};
  }
};

/// Corners and planes only (`complete`).
inline TriangleLanes<EightLanes> begin_lanes(const EightTriangles& triangles) {
  TriangleLanes<EightLanes> t;
  for (int k = 0; k < 3; ++k) t.corners[k] = vectors(triangles.corners[k]);
  t.normals = vectors(triangles.planes), t.offsets = eight(triangles.planes.w);
  return t;
}
inline TriangleLanes<EightLanes> make_lanes(const EightTriangles& triangles) {
  TriangleLanes<EightLanes> t = begin_lanes(triangles);
  t.complete();
  return t;
}

}  // namespace fathom
