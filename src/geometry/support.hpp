// Support points and bounds of shapes: pure functions for host and device.
#pragma once

#include "geometry/geometry.hpp"

namespace fathom {

/// Index of the hull's vertex that is farthest along `direction`; the first of equals.
FATHOM_HD int support_vertex(const HullView& hull, Vec3 direction) {
  int best = 0;
  float farthest = dot(hull.vertices[0], direction);
  for (int i = 1; i < hull.vertex_count; ++i) {
    const float d = dot(hull.vertices[i], direction);
    if (d > farthest) {
      farthest = d;
      best = i;
    }
  }
  return best;
}

/// Point of the shape farthest along `direction`, both in the shape's frame. The direction need not have unit length;
/// for zero the result is some point of the surface.
FATHOM_HD Vec3 support(const Geometry& shape, Vec3 direction) {
  const Vec3 h = shape.half_extents;
  switch (shape.type) {
    case ShapeType::sphere:
      return shape.radius * normalize(direction);
    case ShapeType::capsule:
      return mul_add({0, 0, direction.z < 0 ? -h.z : h.z}, shape.radius, normalize(direction));
    case ShapeType::box:
      return {direction.x < 0 ? -h.x : h.x, direction.y < 0 ? -h.y : h.y, direction.z < 0 ? -h.z : h.z};
    case ShapeType::hull:
      break;
    case ShapeType::mesh:
    case ShapeType::height_field:  // not convex: callers query its triangles or children
    case ShapeType::compound:
      return {};
  }
  const Vec3 vertex = shape.hull.vertices[support_vertex(shape.hull, direction)];
  return shape.radius > 0 ? mul_add(vertex, shape.radius, normalize(direction)) : vertex;
}

/// Bounds of a placed box: tight if it is not rotated.
FATHOM_HD Aabb bounds(const Aabb& box, const Pose& pose) {
  const Vec3 middle = transform(pose, centre(box));
  const Vec3 reach = abs(to_matrix(pose.rotation)) * half_extents(box);
  return {middle - reach, middle + reach};
}

/// Tight bounds of the placed shape, up to the rounding of its corners; for a rotated surface or compound, bounds of
/// its box.
FATHOM_HD Aabb bounds(const Geometry& shape, const Pose& pose) {
  const Vec3 r{shape.radius, shape.radius, shape.radius};
  Vec3 reach = r;
  switch (shape.type) {
    case ShapeType::sphere:
      break;
    case ShapeType::capsule:
      reach = abs(rotate(pose.rotation, shape.half_extents)) + r;
      break;
    case ShapeType::box:
      reach = abs(to_matrix(pose.rotation)) * shape.half_extents;
      break;
    case ShapeType::hull: {
      const Mat3 rotation = to_matrix(pose.rotation);
      Vec3 lower = rotation * shape.hull.vertices[0], upper = lower;
      for (int i = 1; i < shape.hull.vertex_count; ++i) {
        const Vec3 v = rotation * shape.hull.vertices[i];
        lower = min(lower, v);
        upper = max(upper, v);
      }
      return {pose.position + (lower - r), pose.position + (upper + r)};
    }
    case ShapeType::mesh:
    case ShapeType::height_field:
      return bounds(shape.surface().bounds(), pose);
    case ShapeType::compound:
      return bounds(shape.compound().bounds(), pose);
  }
  return {pose.position - reach, pose.position + reach};
}

/// Radius of the smallest ball about the centre of mass that contains the shape (m).
FATHOM_HD float bounding_radius(const Geometry& shape) {
  switch (shape.type) {
    case ShapeType::sphere:
      return shape.radius;
    case ShapeType::capsule:
      return shape.half_extents.z + shape.radius;
    case ShapeType::box:
      return length(shape.half_extents);
    case ShapeType::hull:
      break;
    case ShapeType::mesh:
    case ShapeType::height_field:
      return length(max(abs(shape.surface().bounds().lower), abs(shape.surface().bounds().upper)));
    case ShapeType::compound:
      return shape.compound().outer_radius();
  }
  float farthest = 0;
  for (int i = 0; i < shape.hull.vertex_count; ++i) farthest = max(farthest, length_squared(shape.hull.vertices[i]));
  return fathom::sqrt(farthest) + shape.radius;
}

}  // namespace fathom
