// Slow, simple answers in double precision to compare the narrow phase with.
#pragma once

#include <cmath>
#include <vector>

#include "collision/manifold.hpp"
#include "math/vec3d.hpp"
#include "test_hulls.hpp"

namespace fathom::test {

inline Vec3d rotate(Quat q, Vec3d v) {
  const Vec3d u{double(q.x), double(q.y), double(q.z)};
  const double norm = double(q.w) * double(q.w) + dot(u, u);
  const Vec3d t = (2 / norm) * cross(u, v);
  return v + double(q.w) * t + cross(u, t);
}

/// A convex polyhedron placed in A's frame.
struct Solid {
  struct Plane {
    Vec3d normal;
    double offset;
  };
  std::vector<Vec3d> vertices;
  std::vector<Plane> planes;
  std::vector<Vec3d> edges;  ///< unit directions
};

inline Solid place(const TestHull& hull, const Pose& pose) {
  Solid solid;
  for (Vec3 v : hull.vertices) solid.vertices.push_back(rotate(pose.rotation, to_double(v)) + to_double(pose.position));
  for (std::size_t f = 0; f < hull.planes.size(); ++f) {
    const auto& first = hull.edges[hull.face_edges[f]];
    const auto& second = hull.edges[first.next];
    const auto& third = hull.edges[second.next];
    const Vec3d a = solid.vertices[first.origin], b = solid.vertices[second.origin], c = solid.vertices[third.origin];
    Vec3d n = cross(b - a, c - a);
    n = (1 / length(n)) * n;
    solid.planes.push_back({n, dot(n, a)});
  }
  for (std::size_t e = 0; e < hull.edges.size(); e += 2) {
    const Vec3d d = solid.vertices[hull.edges[e + 1].origin] - solid.vertices[hull.edges[e].origin];
    solid.edges.push_back((1 / length(d)) * d);
  }
  return solid;
}

/// Gap between the projections of b and a on the axis, with b on its positive side.
inline double gap(const Solid& a, const Solid& b, Vec3d axis) {
  double highest = -1e300, lowest = 1e300;
  for (Vec3d v : a.vertices) highest = std::max(highest, dot(axis, v));
  for (Vec3d v : b.vertices) lowest = std::min(lowest, dot(axis, v));
  return lowest - highest;
}

/// Largest gap over all face normals and all cross products of edges.
inline double sat_separation(const Solid& a, const Solid& b) {
  double best = -1e300;
  for (const auto& p : a.planes) best = std::max(best, gap(a, b, p.normal));
  for (const auto& p : b.planes) best = std::max(best, gap(a, b, -1.0 * p.normal));
  for (Vec3d ea : a.edges) {
    for (Vec3d eb : b.edges) {
      Vec3d axis = cross(ea, eb);
      const double l = length(axis);
      if (l < 1e-6) continue;
      axis = (1 / l) * axis;
      best = std::max(best, std::max(gap(a, b, axis), gap(a, b, -1.0 * axis)));
    }
  }
  return best;
}

/// How far the point is outside the solid's planes; negative inside.
inline double height_over(const Solid& solid, Vec3d point) {
  double h = -1e300;
  for (const auto& p : solid.planes) h = std::max(h, dot(p.normal, point) - p.offset);
  return h;
}

inline double lowest_separation(const Manifold& m) {
  double lowest = 1e300;
  for (int i = 0; i < m.count; ++i) lowest = std::min(lowest, double(m.points[i].separation));
  return lowest;
}

inline Pose inverse(const Pose& p) { return {-inverse_rotate(p.rotation, p.position), 0, conjugate(p.rotation)}; }

}  // namespace fathom::test
