// Dispatch over shape types, for host and device.
#pragma once

#include "collision/box_box.hpp"

namespace fathom {

/// What `collide` does, as a function that kernels can include.
FATHOM_HD Manifold collide_shapes(const Geometry& a, const Geometry& b, const Pose& b_in_a, float margin,
                                  AxisCache& cache) {
  if (a.type == ShapeType::box && b.type == ShapeType::box) {
    return collide_boxes(a.half_extents, b.half_extents, b_in_a, margin, cache);
  }
  return {};
}

}  // namespace fathom
