// Which triangles a shape may meet on its way.
#pragma once

#include <span>
#include <vector>

#include "terrain/eight_triangles.hpp"
#include "terrain/surface_triangle.hpp"
#include "terrain/turned_shape.hpp"

namespace fathom {

/// How a shape moves within a step.
struct ShapeMotion {
  Vec3 way;      ///< m, of its centre
  Vec3 turn;     ///< rad, about its centre
  float beside;  ///< m, how far a point may get from the straight line to where `way` and `turn` take it
};

/// A shape and its motion: the vertices of its core, each where it begins and where the motion takes it.
class ShapeOnWay {
 public:
  /// Replaces the former shape, which must outlive this; reuses memory.
  void set(const TurnedShape& shape, const ShapeMotion& motion);

  const TurnedShape& shape() const { return *shape_; }
  std::span<const Vec3> points() const { return points_; }
  /// Largest height (m) of all points along the normal of the shape's face f.
  float reach_of_face(int f) const { return reaches_[static_cast<std::size_t>(f)]; }
  /// How far (m) the shape may get beyond the points.
  float around() const { return around_; }

 private:
  const TurnedShape* shape_ = nullptr;
  std::vector<Vec3> points_;
  std::vector<float> reaches_;
  float around_ = 0;
};

/// A bit for each triangle to which the shape may come nearer than `skin` (m) on its way; the others have a fixed
/// separating axis.
unsigned met_on_way(const EightTriangles& triangles, const ShapeOnWay& moving, float skin);

}  // namespace fathom
