// Contact of one triangle of a surface with a convex shape.
//
// Everything is told in the surface's axes with the convex shape's centre as origin, so that surfaces of kilometres
// cost no precision. A triangle is solid behind: bodies touch its outside alone, and of the axes across its edges and
// corners only those count along which the surface beside it does not rise. A flat floor of many triangles then has no
// edges to catch on.
#pragma once

#include "collision/manifold.hpp"
#include "terrain/triangle_axes.hpp"

namespace fathom {

/// The surface around the triangles that are looked at.
class Surroundings {
 public:
  /// Whether the surface beside the triangle, where it shares the corners `tips` (a bit each) with others, rises above
  /// the plane across `axis` (unit, outward) through them.
  virtual bool rises(const SurfaceTriangle& triangle, unsigned tips, Vec3 axis) const = 0;

 protected:
  ~Surroundings() = default;
};

/// The least separation of the manifold's points (m), of which there is one.
inline float nearest_of(const Manifold& m) {
  float nearest = m.points[0].separation;
  for (int i = 1; i < m.count; ++i) nearest = min(nearest, m.points[i].separation);
  return nearest;
}

struct TriangleContact {
  Manifold manifold;
  /// The shape reaches behind the triangle and may well touch another side of the surface there: it has a shorter way
  /// out, along which the surface beside rises.
  bool is_doubtful = false;
  bool is_deep = false;  ///< and further than it is thick
};

/// Where a triangle and the shape are nearer than `margin` (m); the normal points from the triangle to the shape. The
/// triangle is one of those that `axes` (of eight, `axes_of`) calls near, number `lane`.
TriangleContact collide_triangle(const SurfaceTriangle& triangle, const TriangleAxes& axes, int lane,
                                 const TurnedShape& shape, float margin, const Surroundings& surroundings);

}  // namespace fathom
