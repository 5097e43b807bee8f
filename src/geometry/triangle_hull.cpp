// Quickhull (Barber, Dobkin, Huhdanpaa: The Quickhull Algorithm for Convex Hulls, 1996) with exact decisions.
//
// Rounding is what breaks hulls: a point above one of two coplanar triangles and below the other tears the mesh. So
// points are first snapped to a grid of 2^26 steps to the half extent, finer than the float input. Normals then fit
// into 64 bits and orientations into 128 bits, so the faces that a point sees are found exactly. For any cloud,
// the visible triangles are then a disc and its rim is a single cycle.
//
// Coplanar points of a real cloud are coplanar only up to rounding. Two rules keep this noise out of the hull. A point
// is added only if it sticks out by more than the tolerance. Of the points that are farthest up to the tolerance, the
// one farthest from the centre is taken. A convex function is largest at a corner, so corners come before points inside
// faces and edges, which then no longer stick out.
#include "geometry/triangle_hull.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fathom/error.hpp>
#include <string>

#include "math/text.hpp"

namespace fathom {
namespace {

__extension__ typedef __int128 Int128;

constexpr int grid_bits = 26;
constexpr double snap_tolerance = 4;         // × noise: points that stick out less are ignored
constexpr double degenerate_tolerance = 32;  // × noise: a thinner cloud has no volume
// Coplanar merging can remove vertices again, but never three of four.
constexpr int vertex_limit = 1020;

[[noreturn]] void refuse(const std::string& what) { throw Error(ErrorCode::degenerate_shape, "fathom::hull: " + what); }

struct GridPoint {
  std::int64_t x, y, z;
};
GridPoint operator-(GridPoint a, GridPoint b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
GridPoint cross(GridPoint a, GridPoint b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Int128 dot(GridPoint a, GridPoint b) { return Int128{a.x} * b.x + Int128{a.y} * b.y + Int128{a.z} * b.z; }
Vec3d rounded(GridPoint a) { return {static_cast<double>(a.x), static_cast<double>(a.y), static_cast<double>(a.z)}; }

/// The cloud on its grid; `noise` in grid steps.
struct Cloud {
  std::vector<GridPoint> points;
  Vec3d centre;
  double step = 0;
  double noise = 0;
};

Cloud snap(std::span<const Vec3> points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (is_finite(points[i])) continue;
    throw Error(ErrorCode::invalid_argument,
                "fathom::hull: point " + std::to_string(i) + " is not finite; check the mesh it was read from");
  }
  if (points.size() < 4) {
    refuse(std::to_string(points.size()) + " points span no volume; give at least 4 that do not share a plane");
  }
  Vec3 lower = points[0], upper = points[0];
  for (const Vec3 p : points) lower = min(lower, p), upper = max(upper, p);
  const Vec3d half = 0.5 * (to_double(upper) - to_double(lower));
  const double extent = std::max({half.x, half.y, half.z});
  if (!(extent > 0)) {
    refuse("all " + std::to_string(points.size()) + " points coincide; give at least 4 that do not share a plane");
  }

  Cloud cloud;
  cloud.step = std::ldexp(1.0, std::ilogb(extent) + 1 - grid_bits);
  const auto to_grid = [&](double a) { return std::round(a / cloud.step); };
  const Vec3d middle = 0.5 * (to_double(upper) + to_double(lower));
  cloud.centre = cloud.step * Vec3d{to_grid(middle.x), to_grid(middle.y), to_grid(middle.z)};
  const double farthest = to_double(max_component(max(abs(lower), abs(upper))));
  cloud.noise = std::ldexp(farthest, -23) / cloud.step;
  cloud.points.reserve(points.size());
  for (const Vec3 p : points) {
    const Vec3d q = to_double(p) - cloud.centre;
    cloud.points.push_back(
        {std::llround(q.x / cloud.step), std::llround(q.y / cloud.step), std::llround(q.z / cloud.step)});
  }
  return cloud;
}

class Builder {
  struct Face {
    TriangleHull::Triangle triangle;
    GridPoint normal;     // exact; length is twice the area
    Vec3d unit;           // the same, rounded and normalised
    double farthest = 0;  // height of the highest point above the face
    bool alive = true;
  };

  auto height_above(const Face& face) const {
    return [this, unit = face.unit, origin = points_[face.triangle.vertex[0]]](int i) {
      return dot(unit, points_[i] - origin);
    };
  }

 public:
  explicit Builder(const Cloud& cloud) : cloud_(cloud), tolerance_(snap_tolerance * cloud.noise) {
    for (const GridPoint p : cloud.points) points_.push_back(rounded(p));
    new_face_at_.resize(points_.size());
  }

  void run() {
    make_simplex();
    int count = 4;
    for (int face = farthest_outside(); face >= 0; face = farthest_outside()) {
      if (++count > vertex_limit) {
        refuse("the hull of the " + std::to_string(points_.size()) +
               " points has more than 255 vertices; simplify the mesh or split it into several convex parts");
      }
      add(farthest_point(height_above(faces_[face]), faces_[face].farthest));
    }
  }

  TriangleHull result() const {
    TriangleHull hull;
    hull.centre = cloud_.centre;
    hull.noise = cloud_.noise * cloud_.step;
    std::vector<int> vertex_index(points_.size(), -1), face_index(faces_.size(), -1);
    int faces = 0;
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      if (!faces_[i].alive) continue;
      face_index[i] = faces++;
      for (const int v : faces_[i].triangle.vertex) vertex_index[v] = 0;
    }
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (vertex_index[i] < 0) continue;
      vertex_index[i] = static_cast<int>(hull.vertices.size());
      hull.vertices.push_back(cloud_.step * points_[i]);
    }
    for (const Face& face : faces_) {
      if (!face.alive) continue;
      TriangleHull::Triangle t = face.triangle;
      for (int& v : t.vertex) v = vertex_index[v];
      for (int& n : t.neighbour) n = face_index[n];
      hull.triangles.push_back(t);
    }
    return hull;
  }

 private:
  /// The largest value of `measure(i)` over all points.
  template <class Measure>
  double largest(const Measure& measure) const {
    double most = measure(0);
    for (int i = 1; i < static_cast<int>(points_.size()); ++i) most = std::max(most, measure(i));
    return most;
  }

  /// Among the points whose measure is the largest up to the tolerance, the one farthest from the centre.
  template <class Measure>
  int farthest_point(const Measure& measure, double most) const {
    const double enough = std::max(most - tolerance_, std::min(most, tolerance_));
    int best = -1;
    double best_distance = -1;
    for (int i = 0; i < static_cast<int>(points_.size()); ++i) {
      if (measure(i) < enough) continue;
      const double distance = dot(points_[i], points_[i]);
      if (distance > best_distance) best = i, best_distance = distance;
    }
    return best;
  }

  void make_simplex() {
    const double thinnest = degenerate_tolerance * cloud_.noise;
    const std::string within = " within " + text(thinnest * cloud_.step) + " m, the precision of their coordinates; ";
    const auto span = [&](const auto& measure, const char* fault, const char* remedy) {
      const double most = largest(measure);
      if (most <= thinnest) refuse("the " + std::to_string(points_.size()) + " points " + fault + within + remedy);
      return farthest_point(measure, most);
    };
    const int a =
        farthest_point([&](int i) { return length(points_[i]); }, largest([&](int i) { return length(points_[i]); }));
    const int b = span([&](int i) { return length(points_[i] - points_[a]); }, "coincide",
                       "give at least 4 that do not share a plane, or build the hull about the origin");
    const Vec3d axis = (1 / length(points_[b] - points_[a])) * (points_[b] - points_[a]);
    const int c = span([&](int i) { return length(cross(axis, points_[i] - points_[a])); }, "are collinear",
                       "use a capsule for a rod, or give it thickness");
    const Vec3d normal = cross(axis, points_[c] - points_[a]);
    const Vec3d unit = (1 / length(normal)) * normal;
    const int d = span([&](int i) { return std::abs(dot(unit, points_[i] - points_[a])); }, "are coplanar",
                       "use a box for a plate, or give it thickness");

    const bool below = dot(unit, points_[d] - points_[a]) < 0;
    const int v0 = a, v1 = below ? b : c, v2 = below ? c : b, v3 = d;
    // Face i is opposite vertex 3 − i.
    add_face({{v0, v1, v2}, {1, 3, 2}});
    add_face({{v1, v0, v3}, {0, 2, 3}});
    add_face({{v0, v2, v3}, {0, 3, 1}});
    add_face({{v2, v1, v3}, {0, 1, 2}});
  }

  void add_face(const TriangleHull::Triangle& triangle) {
    const auto& p = cloud_.points;
    const auto& v = triangle.vertex;
    Face face{triangle, cross(p[v[1]] - p[v[0]], p[v[2]] - p[v[0]]), {}};
    const Vec3d normal = rounded(face.normal);
    face.unit = (1 / length(normal)) * normal;
    face.farthest = largest(height_above(face));
    faces_.push_back(face);
  }

  /// The face with the highest point above it, or −1 if no point sticks out of any.
  int farthest_outside() const {
    int best = -1;
    double most = tolerance_;
    for (int i = 0; i < static_cast<int>(faces_.size()); ++i) {
      if (faces_[i].alive && faces_[i].farthest > most) best = i, most = faces_[i].farthest;
    }
    return best;
  }

  bool sees(int point, const Face& face) const {
    const auto& p = cloud_.points;
    return dot(face.normal, p[point] - p[face.triangle.vertex[0]]) > 0;
  }

  /// Replaces the faces visible from `point` by a cone from their rim to the point.
  void add(int point) {
    std::vector<int> seen;
    for (int i = 0; i < static_cast<int>(faces_.size()); ++i) {
      if (faces_[i].alive && sees(point, faces_[i])) seen.push_back(i);
    }
    for (const int i : seen) faces_[i].alive = false;
    const int first_new = static_cast<int>(faces_.size());
    for (const int i : seen) {
      const TriangleHull::Triangle old = faces_[i].triangle;
      for (std::size_t e = 0; e < 3; ++e) {
        const int outside = old.neighbour[e];
        if (!faces_[outside].alive) continue;
        const int from = old.vertex[e], to = old.vertex[(e + 1) % 3];
        const int created = static_cast<int>(faces_.size());
        TriangleHull::Triangle& beyond = faces_[outside].triangle;
        const auto back = std::find(beyond.vertex.begin(), beyond.vertex.end(), to) - beyond.vertex.begin();
        beyond.neighbour[static_cast<std::size_t>(back)] = created;
        new_face_at_[from] = created;
        add_face({{from, to, point}, {outside, -1, -1}});
      }
    }
    for (int i = first_new; i < static_cast<int>(faces_.size()); ++i) {
      const int next = new_face_at_[faces_[i].triangle.vertex[1]];
      faces_[i].triangle.neighbour[1] = next;
      faces_[next].triangle.neighbour[2] = i;
    }
  }

  const Cloud& cloud_;
  const double tolerance_;  // in grid steps
  std::vector<Vec3d> points_;
  std::vector<Face> faces_;
  std::vector<int> new_face_at_;  // indexed by the vertex where the new face's rim edge starts
};

}  // namespace

TriangleHull triangle_hull(std::span<const Vec3> points) {
  const Cloud cloud = snap(points);
  Builder builder(cloud);
  builder.run();
  return builder.result();
}

}  // namespace fathom
