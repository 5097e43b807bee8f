// Contact of a triangle of a surface with a convex shape.
//
// All in the surface's axes with the convex shape's centre as origin, so that surfaces of kilometres cost no precision.
// A triangle is solid behind: bodies touch only its outside, and axes across its edges and corners count only if the
// adjacent surface does not rise along them. So a flat floor of many triangles has no edges to catch on.
#pragma once

#include "collision/manifold.hpp"
#include "terrain/triangle_axes.hpp"

namespace fathom {

/// The surface around the tested triangles.
class Surroundings {
 public:
  /// Whether the surface adjacent to the triangle at its shared corners `tips` (a bit each) rises above the plane
  /// through them with normal `axis` (unit, outward).
  virtual bool rises(const SurfaceTriangle& triangle, unsigned tips, Vec3 axis) const = 0;

 protected:
  ~Surroundings() = default;
};

/// The smallest separation (m) of the manifold's points (at least one).
inline float nearest_of(const Manifold& m) {
  float nearest = m.points[0].separation;
  for (int i = 1; i < m.count; ++i) nearest = min(nearest, m.points[i].separation);
  return nearest;
}

struct TriangleContact {
  Manifold manifold;
  /// The shape reaches behind the triangle and probably touches another side of the surface there: it has a shorter
  /// way out in a direction in which the adjacent surface rises.
  bool is_doubtful = false;
  bool is_deep = false;  ///< … and reaches deeper than the shape is thick
};

/// The contact where a triangle and the shape are nearer than `margin` (m); the normal points from the triangle to the
/// shape. `axes` (of eight, `axes_of`) must call the triangle, number `lane`, near.
TriangleContact collide_triangle(const SurfaceTriangle& triangle, const TriangleAxes& axes, int lane,
                                 const TurnedShape& shape, float margin, const Surroundings& surroundings);

}  // namespace fathom
