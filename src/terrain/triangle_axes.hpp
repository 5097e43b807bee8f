// The axes that separate triangles from a convex shape (separating axis theorem), for eight triangles at once: most
// triangles that a shape's bounds meet are farther away than the margin and need no individual test.
#pragma once

#include <span>

#include "terrain/eight_triangles.hpp"
#include "terrain/turned_shape.hpp"

namespace fathom {

/// Results for each of eight triangles.
struct TriangleAxes {
  unsigned near = 0;  ///< a bit for each triangle that no axis separates by more than the margin
  // For a box or a hull:
  alignas(32) float of_normal[8];  ///< m, separation along the triangle's normal
  alignas(32) float of_face[8];    ///< m, along the normal of the shape's best face
  alignas(32) std::int32_t face[8];
  /// Edges of the triangle and of the shape with the largest separation, if that exceeds the separation of all faces by
  /// more than the tolerance; else −1.
  alignas(32) std::int32_t edge[8], edge_of_shape[8];

  /// Those of one triangle.
  AxesOfTriangles<OneLane> at(int lane) const {
    return {(near >> lane & 1) != 0, of_normal[lane], of_face[lane], face[lane], edge[lane], edge_of_shape[lane]};
  }
};

/// `pushed`: unit normals along which the surface already pushes the shape (triangle_axes-inl.hpp). `margin` in m.
TriangleAxes axes_of(const EightTriangles& triangles, const TurnedShape& shape, float margin,
                     std::span<const Vec3> pushed);

}  // namespace fathom
