// A convex shape rotated into a surface's axes, with its centre at the origin.
#pragma once

#include <vector>

#include "collision/box_hull.hpp"
#include "collision/round_shapes.hpp"

namespace fathom {

/// An edge of a polyhedron and its arc on the Gauss map, between the normals of its two faces.
struct EdgeArc {
  Vec3 from, along;
  Vec3 of_left, of_right;  ///< bounds of the arc: a normal on it is between these
  Vec3 middle;             ///< sum of the faces' normals
};

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
  const std::vector<EdgeArc>& edges() const;  ///< of a box or a hull, rotated; built on first use
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
  mutable std::vector<EdgeArc> edges_;
  float inner_ = 0, outer_ = 0;
};

}  // namespace fathom
