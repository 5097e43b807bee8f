// Builds a `Hull` from a point cloud: triangles, then polygons, then the arrays the simulators read.
#pragma once

#include <fathom/shape.hpp>
#include <span>

namespace fathom {

class HullBuilder {
 public:
  /// The hull of the points, to which everything within `radius` (m) of it belongs, too. Throws as described at
  /// `fathom::hull`.
  static Hull build(std::span<const Vec3> points, float radius = 0);
};

}  // namespace fathom
