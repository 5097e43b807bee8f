// The axes that separate triangles from a convex shape (the separating axis theorem), for eight triangles at once: most
// triangles that a shape's bounds meet are farther from it than the margin, and need not be looked at one by one.
#pragma once

#include <span>

#include "terrain/surface_triangle.hpp"
#include "terrain/turned_shape.hpp"

namespace fathom {

/// Of each of eight triangles.
struct TriangleAxes {
  unsigned near = 0;  ///< a bit for each triangle that no axis shows to be farther away than the margin
  // Of a box or a hull:
  alignas(32) float of_normal[8];  ///< m, separation along the triangle's normal
  alignas(32) float of_face[8];    ///< m, along the normal of the shape's best face
  alignas(32) std::int32_t face[8];
  /// Edge of the triangle and of the shape with the largest separation, if that is larger than those of all faces by
  /// more than the tolerance; −1: none is.
  alignas(32) std::int32_t edge[8], edge_of_shape[8];
};

/// None is near whose front the shape's centre lies further behind than half its inner radius: the shape is then taken
/// to come from behind, where a surface is open. One that the surface already pushes along one of `pushed` (unit) has
/// come from the front, and may be pressed in by its whole size. `margin` in m.
TriangleAxes axes_of(const EightTriangles& triangles, const TurnedShape& shape, float margin,
                     std::span<const Vec3> pushed);

}  // namespace fathom
