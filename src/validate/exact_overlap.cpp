#include "validate/exact_overlap.hpp"

#include <algorithm>
#include <cmath>
#include <fathom/error.hpp>
#include <limits>

#include "validate/frame.hpp"

namespace fathom::validate {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

/// Unit normal of a polygon by Newell's sums, which nearly collinear corners do not degrade (Sutherland et al. 1974).
Vec3d polygon_normal(const std::vector<Vec3d>& corners, const std::vector<int>& polygon) {
  Vec3d sum;
  const Vec3d about = corners[static_cast<std::size_t>(polygon[0])];
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const std::size_t next = (i + 1) % polygon.size();
    sum += cross(corners[static_cast<std::size_t>(polygon[i])] - about,
                 corners[static_cast<std::size_t>(polygon[next])] - about);
  }
  return 1 / length(sum) * sum;
}

double squared(Vec3d a) { return dot(a, a); }

Vec3d nearest_on_segment(Vec3d p, Vec3d a, Vec3d b) {
  const Vec3d along = b - a;
  const double square = squared(along);
  const double t = square > 0 ? std::clamp(dot(p - a, along) / square, 0.0, 1.0) : 0;
  return a + t * along;
}

double distance_to_segment(Vec3d p, Vec3d a, Vec3d b) { return length(p - nearest_on_segment(p, a, b)); }

/// Distance of two segments: that of the lines if their nearest points lie within both, else that of an end point.
double segment_distance(Vec3d a, Vec3d b, Vec3d c, Vec3d d) {
  double least = std::min({distance_to_segment(a, c, d), distance_to_segment(b, c, d), distance_to_segment(c, a, b),
                           distance_to_segment(d, a, b)});
  const Vec3d u = b - a, v = d - c, w = c - a;
  const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), det = uu * vv - uv * uv;
  if (det > 1e-14 * uu * vv) {  // otherwise parallel: an end is among the nearest points
    const double s = (dot(u, w) * vv - dot(v, w) * uv) / det, t = (dot(u, w) * uv - dot(v, w) * uu) / det;
    if (s >= 0 && s <= 1 && t >= 0 && t <= 1) least = std::min(least, length(a + s * u - (c + t * v)));
  }
  return least;
}

Vec3d corner(const Solid& solid, int i) { return solid.corners[static_cast<std::size_t>(i)]; }

/// How far the cores overlap along a unit direction from a to b; negative if they are apart.
double overlap_along(const Solid& a, const Solid& b, Vec3d direction) {
  double a_end = -infinite, b_begin = infinite;
  for (const Vec3d& p : a.corners) a_end = std::max(a_end, dot(p, direction));
  for (const Vec3d& p : b.corners) b_begin = std::min(b_begin, dot(p, direction));
  return a_end - b_begin;
}

/// Penetration depth of two cores, at least one of them a polyhedron: the least overlap along any direction that can be
/// a face normal of their Minkowski difference. Negative if they are apart (Gottschalk 1996).
double core_overlap(const Solid& a, const Solid& b) {
  double least = infinite;
  const auto try_direction = [&](Vec3d direction) { least = std::min(least, overlap_along(a, b, direction)); };
  for (const Solid::Face& face : a.faces) try_direction(face.normal);
  for (const Solid::Face& face : b.faces) try_direction(-1.0 * face.normal);
  if (least < 0) return least;
  // A point or segment in a triangle's plane can only be separated from it along that plane.
  for (const Solid* flat : {&a, &b})
    if (flat->faces.size() == 2)
      for (const Solid* edged : {&a, &b})
        for (const auto& [i, j] : edged->edges) {
          const Vec3d across = cross(corner(*edged, j) - corner(*edged, i), flat->faces[0].normal);
          const double size = length(across);
          if (!(size > 1e-9 * length(corner(*edged, j) - corner(*edged, i)))) continue;
          try_direction(1 / size * across);
          try_direction(-1 / size * across);
        }
  if (least < 0) return least;
  for (const auto& [i, j] : a.edges)
    for (const auto& [k, l] : b.edges) {
      const Vec3d u = corner(a, j) - corner(a, i), v = corner(b, l) - corner(b, k), n = cross(u, v);
      const double sine = length(n);
      if (!(sine > 1e-9 * length(u) * length(v))) continue;  // parallel: covered by the face normals
      try_direction(1 / sine * n);
      try_direction(-1 / sine * n);
      if (least < 0) return least;
    }
  return least;
}

double distance_to_face(const Solid& solid, const Solid::Face& face, Vec3d p) {
  const double height = dot(face.normal, p - corner(solid, face.corners[0]));
  bool is_over = true;
  double least = infinite;
  for (std::size_t i = 0; i < face.corners.size(); ++i) {
    const Vec3d from = corner(solid, face.corners[i]);
    const Vec3d to = corner(solid, face.corners[(i + 1) % face.corners.size()]);
    if (dot(cross(to - from, p - from), face.normal) < 0) is_over = false;
    least = std::min(least, distance_to_segment(p, from, to));
  }
  return is_over ? std::abs(height) : least;
}

/// Distance of two cores, at least one of them a polyhedron, that are apart: face to corner, or edge to edge.
double distance_outside(const Solid& a, const Solid& b) {
  double least = infinite;
  for (const auto& [solid, other] : {std::pair{&a, &b}, std::pair{&b, &a}})
    for (const Solid::Face& face : solid->faces)
      for (const Vec3d& end : other->corners) least = std::min(least, distance_to_face(*solid, face, end));
  for (const auto& [i, j] : a.edges)
    for (const auto& [k, l] : b.edges)
      least = std::min(least, segment_distance(corner(a, i), corner(a, j), corner(b, k), corner(b, l)));
  return least;
}

/// Distance of two points or segments.
double round_distance(const Solid& a, const Solid& b) {
  const Vec3d& a0 = a.corners.front();
  const Vec3d& b0 = b.corners.front();
  return segment_distance(a0, a.corners.back(), b0, b.corners.back());
}

}  // namespace

Solid::Solid(const Shape& shape, const Pose& pose) : radius(to_double(shape.radius)) {
  const Frame frame(pose);
  const Vec3d h = to_double(shape.half_extents);
  switch (shape.type) {
    case ShapeType::sphere:
      corners = {frame.origin};
      break;
    case ShapeType::capsule:
      corners = {frame({0, 0, -h.z}), frame({0, 0, h.z})};
      edges = {{0, 1}};
      break;
    case ShapeType::box:
      radius = 0;
      for (int i = 0; i < 8; ++i)
        corners.push_back(frame({i & 1 ? h.x : -h.x, i & 2 ? h.y : -h.y, i & 4 ? h.z : -h.z}));
      for (int i = 0; i < 8; ++i)
        for (const int bit : {1, 2, 4})
          if (!(i & bit)) edges.push_back({i, i | bit});
      for (const auto& polygon :
           {std::vector{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}})
        faces.push_back({polygon_normal(corners, polygon), polygon});
      break;
    case ShapeType::hull: {
      const Hull& hull = *shape.hull;
      for (const Vec3& p : hull.vertices()) corners.push_back(frame(to_double(p)));
      const auto origin = [&](std::size_t edge) { return static_cast<int>(hull.edges()[edge].origin); };
      for (std::size_t edge = 0; edge < hull.edges().size(); edge += 2)
        edges.push_back({origin(edge), origin(edge + 1)});
      for (const std::uint16_t first : hull.face_edges()) {
        std::vector<int> polygon;
        std::uint16_t edge = first;
        do {
          polygon.push_back(origin(edge));
          edge = hull.edges()[edge].next;
        } while (edge != first);
        faces.push_back({polygon_normal(corners, polygon), polygon});
      }
      break;
    }
    case ShapeType::mesh:
    case ShapeType::height_field:
    case ShapeType::compound:
      throw Error(ErrorCode::invalid_argument, "a surface or a compound is not a solid");
  }
  find_bounds();
}

Solid::Solid(const Triangle& triangle, const Pose& pose) : edges{{0, 1}, {1, 2}, {2, 0}} {
  const Frame frame(pose);
  for (const Vec3& corner : triangle.corners) corners.push_back(frame(to_double(corner)));
  const Vec3d normal = polygon_normal(corners, {0, 1, 2});
  faces = {{normal, {0, 1, 2}}, {-normal, {0, 2, 1}}};
  find_bounds();
}

void Solid::find_bounds() {
  lower = {infinite, infinite, infinite};
  upper = {-infinite, -infinite, -infinite};
  for (const Vec3d& p : corners) {
    lower = {std::min(lower.x, p.x - radius), std::min(lower.y, p.y - radius), std::min(lower.z, p.z - radius)};
    upper = {std::max(upper.x, p.x + radius), std::max(upper.y, p.y + radius), std::max(upper.z, p.z + radius)};
  }
}

double overlap_depth(const Solid& a, const Solid& b) {
  if (a.lower.x > b.upper.x || a.lower.y > b.upper.y || a.lower.z > b.upper.z || b.lower.x > a.upper.x ||
      b.lower.y > a.upper.y || b.lower.z > a.upper.z)
    return 0;
  const double radii = a.radius + b.radius;
  double between = 0;
  if (a.faces.empty() && b.faces.empty()) {
    between = round_distance(a, b);
  } else {
    const double cores = core_overlap(a, b);
    if (cores >= 0) return cores + radii;
    if (radii == 0) return 0;
    between = distance_outside(a, b);
  }
  return std::max(0.0, radii - between);
}

}  // namespace fathom::validate
