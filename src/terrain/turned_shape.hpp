// A convex shape rotated into a surface's axes, with its centre at the origin.
#pragma once

#include <vector>

#include "collision/box_hull.hpp"
#include "collision/round_shapes.hpp"
#include "terrain/triangle_axes-inl.hpp"

namespace fathom {

class TurnedShape {
 public:
  TurnedShape() = default;
  TurnedShape(const Geometry& shape, Quat rotation) { turn(shape, rotation); }
  TurnedShape(const TurnedShape&) = delete;
  TurnedShape& operator=(const TurnedShape&) = delete;
  /// Replaces the former shape; reuses memory.
  void turn(const Geometry& shape, Quat rotation);

  bool is_round() const { return round_.radius > 0; }
  const RoundShape& round() const { return round_; }
  /// For a box or a hull: in its own axes and rotated.
  const HullView& hull() const { return hull_; }
  const HullView& turned() const { return turned_; }
  /// Edges of a box or a hull, rotated.
  int edge_count() const { return turned_.edge_count / 2; }
  const EdgeArc& edge(int i) const;
  Quat rotation() const { return rotation_; }
  float inner() const { return inner_; }  ///< m, half the smallest thickness
  float outer() const { return outer_; }  ///< m, largest coordinate

 private:
  Quat rotation_;
  RoundShape round_{{}, 0};
  BoxHull box_{{1, 1, 1}};
  HullView hull_, turned_;
  std::vector<Vec3> vertices_;
  std::vector<Hull::Plane> planes_;
  mutable std::vector<EdgeArc> edges_;  // built on first use
  float inner_ = 0, outer_ = 0;
};

}  // namespace fathom
