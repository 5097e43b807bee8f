// The convex hull of a point cloud as triangles: the first stage of building a `Hull`.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "math/vec3d.hpp"

namespace fathom {

struct TriangleHull {
  struct Triangle {
    std::array<int, 3> vertex;     ///< counter-clockwise seen from outside
    std::array<int, 3> neighbour;  ///< the triangle across the edge vertex[i] → vertex[i + 1]
  };
  std::vector<Vec3d> vertices;  ///< m, relative to `centre`
  std::vector<Triangle> triangles;
  Vec3d centre;  ///< m, in the coordinates of the cloud
  double noise =
      0;  ///< rounding error of the cloud's coordinates (m): points within a few times this distance are the same
};

/// Throws `Error{degenerate_shape}` if the points span no volume or the hull would have far more vertices than a `Hull`
/// can hold, `Error{invalid_argument}` on non-finite points. Points less than four times the noise outside the hull of
/// the others may be left out.
TriangleHull triangle_hull(std::span<const Vec3> points);

}  // namespace fathom
