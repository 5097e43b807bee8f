// How far two placed shapes are apart, and where they are nearest: GJK in double precision. Pure, for queries.
//
// E. G. Gilbert, D. W. Johnson, S. S. Keerthi, "A Fast Procedure for Computing the Distance Between Complex Objects in
// Three-Dimensional Space", IEEE J. Robotics and Automation 4 (1988); sub-simplices as in C. Ericson, "Real-Time
// Collision Detection" (2005), section 5.1. The step has its own in single precision (collision/gap.hpp), which gives
// bounds and no points.
#pragma once

#include "geometry/placed_shape.hpp"

namespace fathom {

/// Of A from B. Points are in world axes, as seen from A's position.
struct Separation {
  double distance = 0;  ///< m; 0 where the shapes touch or overlap
  Vec3d on_a, on_b;     ///< nearest points; where the shapes touch or overlap, twice one that both have
  Vec3d normal;         ///< unit, from A to B; zero where the shapes touch or overlap

  bool touch() const { return distance == 0; }
};

/// `shift` (m) moves B. `guess`: about the direction from A to B, of any length.
Separation separation(const PlacedShape& a, const PlacedShape& b, Vec3d shift, Vec3d guess);
inline Separation separation(const PlacedShape& a, const PlacedShape& b) {
  return separation(a, b, {}, b.position - a.position);
}

}  // namespace fathom
