// Builds a `Hull` from a point cloud: triangles, then polygons, then the arrays the simulators read.
#pragma once

#include <fathom/shape.hpp>
#include <span>

namespace fathom {

class HullBuilder {
 public:
  /// Throws as described at `fathom::hull`.
  static Hull build(std::span<const Vec3> points);
};

}  // namespace fathom
