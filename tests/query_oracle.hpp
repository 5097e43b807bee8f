// Simple answers to queries of single shapes, in double precision and without the code under test; shapes and scenes to
// query.
#pragma once

#include <algorithm>
#include <cmath>
#include <fathom/world.hpp>
#include <vector>

#include "random.hpp"

namespace fathom::test {

struct DVec {
  double x = 0, y = 0, z = 0;
};
inline DVec operator+(DVec a, DVec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline DVec operator-(DVec a, DVec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline DVec operator*(double s, DVec a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(DVec a, DVec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline DVec cross(DVec a, DVec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline double length(DVec a) { return std::sqrt(dot(a, a)); }
inline DVec wide(Vec3 a) { return {double(a.x), double(a.y), double(a.z)}; }
inline DVec turned(Quat q, DVec v) {
  const DVec u{double(q.x), double(q.y), double(q.z)};
  const double norm = double(q.w) * double(q.w) + dot(u, u);
  const DVec t = (2 / norm) * cross(u, v);
  return v + double(q.w) * t + cross(u, t);
}
inline DVec turned_back(Quat q, DVec v) { return turned(conjugate(q), v); }

/// A lower bound on the height of a point in the shape's frame above its surface; not above zero inside.
inline double height(const Shape& shape, DVec p) {
  switch (shape.type) {
    case ShapeType::sphere:
      return length(p) - double(shape.radius);
    case ShapeType::capsule: {
      const double h = double(shape.half_extents.z);
      return length(p - DVec{0, 0, std::clamp(p.z, -h, h)}) - double(shape.radius);
    }
    case ShapeType::box: {
      const DVec h = wide(shape.half_extents);
      return std::max({std::abs(p.x) - h.x, std::abs(p.y) - h.y, std::abs(p.z) - h.z});
    }
    case ShapeType::hull:
    case ShapeType::compound:
    case ShapeType::mesh:
    case ShapeType::height_field:
      break;
  }
  double highest = -1e300;
  for (const Hull::Plane& plane : shape.hull->planes())
    highest = std::max(highest, dot(wide(plane.normal), p) - double(plane.offset));
  return highest;
}

/// Extent of the shape along a unit vector in its frame.
inline double reach(const Shape& shape, DVec n) {
  const DVec h = wide(shape.half_extents);
  switch (shape.type) {
    case ShapeType::sphere:
      return double(shape.radius);
    case ShapeType::capsule:
      return double(shape.radius) + h.z * std::abs(n.z);
    case ShapeType::box:
      return h.x * std::abs(n.x) + h.y * std::abs(n.y) + h.z * std::abs(n.z);
    case ShapeType::hull:
    case ShapeType::compound:
    case ShapeType::mesh:
    case ShapeType::height_field:
      break;
  }
  double farthest = -1e300;
  for (const Vec3 v : shape.hull->vertices()) farthest = std::max(farthest, dot(wide(v), n));
  return farthest;
}

/// One of each kind, of approximately the size `size` (m): plates and rods among the boxes and capsules.
inline std::vector<Shape> shapes_of_each_kind(Generator& random, float size = 1) {
  std::vector<Vec3> cloud;
  const int corners = 4 + static_cast<int>(random() % 20);
  for (int i = 0; i < corners; ++i) cloud.push_back(size * in_cube(random));
  const auto part = [&] { return size * std::exp2(uniform(random, -4, 0)); };
  std::vector<Shape> shapes{sphere(part()), capsule(part(), part()), box({part(), part(), part()})};
  try {
    shapes.push_back(hull(cloud));
  } catch (const Error&) {  // too flat
    shapes.push_back(hull(std::vector<Vec3>{{size, 0, 0}, {0, size, 0}, {0, 0, size}, {-size, -size, -size}}));
  }
  return shapes;
}

}  // namespace fathom::test
