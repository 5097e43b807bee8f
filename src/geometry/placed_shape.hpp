// A shape at a pose in double precision, for queries.
//
// Queries have a long range: a ray of a kilometre may hit a pebble, and so may a plate of a kilometre. In single
// precision the pebble would be smaller than the rounding error. Queries run outside the step, so they can afford
// double precision.
#pragma once

#include <algorithm>
#include <cmath>

#include "geometry/geometry.hpp"
#include "math/vec3d.hpp"

namespace fathom {

/// A core (a hull, or a box that may be flat, a segment or a point) and everything within `radius` of it.
struct PlacedShape {
  Vec3d position;       ///< m
  Vec3d axes[3];        ///< the shape's, unit
  Vec3d half;           ///< of the box (m)
  HullView hull;        ///< no vertices if the core is a box
  double radius = 0;    ///< m
  double thinnest = 0;  ///< about half the least width (m)

  FATHOM_HD PlacedShape(const Geometry& shape, const Pose& pose) : position(to_double(pose.position)) {
    const Quat& q = pose.rotation;
    const Vec3d v = to_double(q.vector());
    const double w = to_double(q.w), s = 2 / (w * w + dot(v, v));
    axes[0] = {1 - s * (v.y * v.y + v.z * v.z), s * (v.x * v.y + w * v.z), s * (v.x * v.z - w * v.y)};
    axes[1] = {s * (v.x * v.y - w * v.z), 1 - s * (v.x * v.x + v.z * v.z), s * (v.y * v.z + w * v.x)};
    axes[2] = {s * (v.x * v.z + w * v.y), s * (v.y * v.z - w * v.x), 1 - s * (v.x * v.x + v.y * v.y)};
    const Vec3d extents = to_double(shape.half_extents);
    thinnest = to_double(min_component(shape.half_extents));
    if (shape.type == ShapeType::hull) {
      hull = shape.hull, radius = to_double(shape.radius);
    } else if (shape.type == ShapeType::box) {
      half = extents;
    } else {
      radius = thinnest = to_double(shape.radius);
      if (shape.type == ShapeType::capsule) half.z = extents.z;
    }
  }

  FATHOM_HD Vec3d to_local(Vec3d direction) const {
    return {dot(axes[0], direction), dot(axes[1], direction), dot(axes[2], direction)};
  }
  FATHOM_HD Vec3d to_world(Vec3d local) const { return local.x * axes[0] + (local.y * axes[1] + local.z * axes[2]); }

  /// The core's farthest point along `direction`, relative to `position`, both in world axes.
  FATHOM_HD Vec3d support(Vec3d direction) const {
    const Vec3d d = to_local(direction);
    if (hull.vertex_count == 0)
      return to_world({std::copysign(half.x, d.x), std::copysign(half.y, d.y), std::copysign(half.z, d.z)});
    int best = 0;
    double highest = dot(to_double(hull.vertices[0]), d);
    for (int i = 1; i < hull.vertex_count; ++i) {
      const double height = dot(to_double(hull.vertices[i]), d);
      if (height > highest) highest = height, best = i;
    }
    return to_world(to_double(hull.vertices[best]));
  }

  /// The larger extent from `position`, forwards or backwards, along a unit vector (m).
  FATHOM_HD double reach(Vec3d axis) const {
    return radius + std::max(dot(support(axis), axis), -dot(support(-axis), axis));
  }
  /// The same along the world's axes.
  FATHOM_HD Vec3d reach() const { return {reach({1, 0, 0}), reach({0, 1, 0}), reach({0, 0, 1})}; }
};

}  // namespace fathom
