// Distance between two placed shapes and their nearest points, for queries; gjk.hpp computes it, on host and device.
#pragma once

#include "geometry/placed_shape.hpp"

namespace fathom {

/// Points are in world axes, relative to A's position.
struct Separation {
  double distance = 0;  ///< m; 0 where the shapes touch or overlap
  Vec3d on_a, on_b;     ///< nearest points; if the shapes touch or overlap, both are the same common point
  Vec3d normal;         ///< unit, from A to B; zero where the shapes touch or overlap

  FATHOM_HD bool touch() const { return distance == 0; }
};

/// `shift` (m) moves B. `guess`: approximate direction from A to B, of any length.
Separation separation(const PlacedShape& a, const PlacedShape& b, Vec3d shift, Vec3d guess);
inline Separation separation(const PlacedShape& a, const PlacedShape& b) {
  return separation(a, b, {}, b.position - a.position);
}

}  // namespace fathom
