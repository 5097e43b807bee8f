// Convex polyhedra for the tests, built by brute force: slow, short and independent of the library's builder.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "geometry/geometry.hpp"

namespace fathom::test {

/// Owns the arrays of a hull. Coplanar points become one face.
struct TestHull {
  std::vector<Vec3> vertices;
  std::vector<Hull::HalfEdge> edges;
  std::vector<Hull::Plane> planes;
  std::vector<std::uint16_t> face_edges;

  Geometry geometry() const {
    return {ShapeType::hull,
            0,
            {0, 0, 0},
            {vertices.data(), edges.data(), planes.data(), face_edges.data(), static_cast<int>(vertices.size()),
             static_cast<int>(edges.size()), static_cast<std::int16_t>(planes.size())}};
  }
};

/// All points must be corners of their convex hull; they are shifted so that their mean is the origin.
inline TestHull make_hull(std::vector<Vec3> points) {
  Vec3 mean;
  for (const Vec3& p : points) mean += (1.0f / static_cast<float>(points.size())) * p;
  for (Vec3& p : points) p -= mean;
  float extent = 0;
  for (const Vec3& p : points) extent = std::max(extent, length(p));
  const double flat = 2e-6 * double(extent);

  TestHull hull;
  hull.vertices = points;
  const int n = static_cast<int>(points.size());
  std::vector<std::vector<int>> loops;
  const auto known = [&](int i, int j, int k) {
    return std::any_of(loops.begin(), loops.end(), [&](const std::vector<int>& loop) {
      const auto has = [&](int v) { return std::find(loop.begin(), loop.end(), v) != loop.end(); };
      return has(i) && has(j) && has(k);
    });
  };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      for (int k = 0; k < n; ++k) {
        if (i == j || j == k || k == i || known(i, j, k)) continue;
        const Vec3 area = cross(points[j] - points[i], points[k] - points[i]);
        if (length(area) < 1e-9f * extent * extent) continue;
        const Vec3 normal = normalize(area);
        std::vector<int> on;
        bool outside = false;
        for (int m = 0; m < n && !outside; ++m) {
          const Vec3 d = points[m] - points[i];
          const double h =
              double(d.x) * double(normal.x) + double(d.y) * double(normal.y) + double(d.z) * double(normal.z);
          outside = h > flat;
          if (std::abs(h) <= flat) on.push_back(m);
        }
        if (outside) continue;
        Vec3 middle;
        for (int m : on) middle += (1.0f / static_cast<float>(on.size())) * points[m];
        const Vec3 x = normalize(points[on[0]] - middle), y = cross(normal, x);
        std::sort(on.begin(), on.end(), [&](int a, int b) {
          const auto angle = [&](int v) { return std::atan2(dot(points[v] - middle, y), dot(points[v] - middle, x)); };
          return angle(a) < angle(b);
        });
        loops.push_back(on);
        hull.planes.push_back({normal, dot(normal, middle)});
      }
    }
  }
  std::map<std::pair<int, int>, int> index;  // directed edge → half-edge
  for (const auto& loop : loops) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const int from = loop[i], to = loop[(i + 1) % loop.size()];
      if (index.count({from, to}) != 0) continue;
      const int e = static_cast<int>(index.size());
      index[{from, to}] = e;
      index[{to, from}] = e + 1;
    }
  }
  hull.edges.resize(index.size());
  for (std::size_t f = 0; f < loops.size(); ++f) {
    const auto& loop = loops[f];
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const int from = loop[i], to = loop[(i + 1) % loop.size()], after = loop[(i + 2) % loop.size()];
      auto& edge = hull.edges[index.at({from, to})];
      edge.origin = static_cast<std::uint8_t>(from);
      edge.face = static_cast<std::uint8_t>(f);
      edge.next = static_cast<std::uint16_t>(index.at({to, after}));
    }
    hull.face_edges.push_back(static_cast<std::uint16_t>(index.at({loop[0], loop[1]})));
  }
  return hull;
}

inline std::vector<Vec3> box_points(Vec3 h) {
  std::vector<Vec3> points;
  for (int i = 0; i < 8; ++i) points.push_back({i & 1 ? h.x : -h.x, i & 2 ? h.y : -h.y, i & 4 ? h.z : -h.z});
  return points;
}

/// Upright prism over a regular polygon.
inline std::vector<Vec3> prism_points(int sides, float radius, float half_height) {
  std::vector<Vec3> points;
  for (int i = 0; i < sides; ++i) {
    const float angle = 2 * pi * static_cast<float>(i) / static_cast<float>(sides);
    for (float z : {-half_height, half_height})
      points.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
  }
  return points;
}

/// Random numbers for the tests: the same sequence on every machine.
class Sampler {
 public:
  explicit Sampler(unsigned seed) : engine_(seed) {}
  float uniform(float lo, float hi) { return lo + (hi - lo) * (static_cast<float>(engine_() >> 8) * 0x1p-24f); }
  int integer(int below) { return static_cast<int>(engine_() % static_cast<unsigned>(below)); }
  Vec3 in_cube(float half) { return {uniform(-half, half), uniform(-half, half), uniform(-half, half)}; }
  Vec3 direction() {
    for (;;) {
      const Vec3 v = in_cube(1);
      if (length(v) > 0.1f && length(v) <= 1) return normalize(v);
    }
  }
  Quat rotation() {
    for (;;) {
      const Quat q{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
      if (dot(q, q) > 0.01f && dot(q, q) <= 1) return normalize(q);
    }
  }
  Quat small_rotation(float angle) {
    const Vec3 v = 0.5f * angle * direction();
    return normalize(Quat{1, v.x, v.y, v.z});
  }

 private:
  std::mt19937 engine_;
};

/// Corners on an ellipsoid, so that all of them are on the hull.
inline std::vector<Vec3> ellipsoid_points(Sampler& random, int count, Vec3 radii) {
  std::vector<Vec3> points;
  while (static_cast<int>(points.size()) < count) {
    const Vec3 d = random.direction();
    const bool near = std::any_of(points.begin(), points.end(), [&](Vec3 p) {
      return distance(Vec3{p.x / radii.x, p.y / radii.y, p.z / radii.z}, d) < 0.2f;
    });
    if (!near) points.push_back({radii.x * d.x, radii.y * d.y, radii.z * d.z});
  }
  return points;
}

}  // namespace fathom::test
