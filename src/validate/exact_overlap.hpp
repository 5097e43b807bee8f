// How deeply two convex shapes overlap, slow and exact: in double precision, by brute force over all features. It
// shares no code with the engine's collision detection, which it judges.
#pragma once

#include <fathom/mesh.hpp>
#include <utility>
#include <vector>

#include "math/vec3d.hpp"

namespace fathom::validate {

/// A placed shape as the set of points within `radius` of a core: a point, a segment or a polyhedron.
struct Solid {
  struct Face {
    Vec3d normal;              ///< outward unit
    std::vector<int> corners;  ///< counter-clockwise seen from outside
  };
  std::vector<Vec3d> corners;
  std::vector<Face> faces;                 ///< empty for points and segments
  std::vector<std::pair<int, int>> edges;  ///< empty for points
  double radius = 0;
  Vec3d lower, upper;  ///< bounds

  Solid(const Shape& shape, const Pose& pose);
  /// A triangle of a placed surface.
  Solid(const Triangle& triangle, const Pose& pose);

 private:
  void find_bounds();
};

/// The least distance (m) by which one must move to end the overlap; 0 if they are apart.
double overlap_depth(const Solid& a, const Solid& b);

}  // namespace fathom::validate
