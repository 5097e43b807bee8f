// Eight triangles side by side against a convex shape: shared by the axis searches.
#pragma once

#include "collision/hull_round.hpp"
#include "terrain/surface_triangle.hpp"

namespace fathom {

inline EightVec3 operator-(const EightVec3& a, const EightVec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline EightVec3 operator*(Eight s, const EightVec3& a) { return {s * a.x, s * a.y, s * a.z}; }
inline EightVec3 cross(const EightVec3& a, const EightVec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Eight length_squared(const EightVec3& a) { return dot(a, a); }
inline Eight largest_coordinate(const EightVec3& a) { return max(abs(a.x), max(abs(a.y), abs(a.z))); }
inline EightVec3 negated_where(EightInts mask, const EightVec3& a) {
  return {select(mask, -a.x, a.x), select(mask, -a.y, a.y), select(mask, -a.z, a.z)};
}

/// Eight triangles, their planes and edges.
struct Triangles {
  EightVec3 corners[3], along[3], inward[3];
  EightPlanes planes;
  Eight squared_lengths[3];
  Eight reach;  ///< largest coordinate (m)

  explicit Triangles(const EightTriangles& t) {
    for (int k = 0; k < 3; ++k) corners[k] = vectors(t.corners[k]);
    planes = {vectors(t.planes), eight(t.planes.w)};
    for (int k = 0; k < 3; ++k) {
      along[k] = corners[(k + 1) % 3] - corners[k];
      inward[k] = cross(planes.normals, along[k]);
      squared_lengths[k] = length_squared(along[k]);
    }
    reach = max(largest_coordinate(corners[0]), max(largest_coordinate(corners[1]), largest_coordinate(corners[2])));
  }
};

/// The lowest heights of a polyhedron's vertices along eight directions.
inline Eight lowest_along(const HullView& shape, const EightVec3& directions) {
  Eight lowest = dot(directions, eight(shape.vertices[0]));
  for (int i = 1; i < shape.vertex_count; ++i) lowest = min(dot(directions, eight(shape.vertices[i])), lowest);
  return lowest;
}

/// Separations of the triangles from the shape's face f.
inline Eight separation_from_face(const HullView& shape, int f, const Triangles& t) {
  const EightVec3 n = eight(shape.planes[f].normal);
  const Eight lowest = min(dot(n, t.corners[0]), min(dot(n, t.corners[1]), dot(n, t.corners[2])));
  return lowest - eight(shape.planes[f].offset);
}

}  // namespace fathom
