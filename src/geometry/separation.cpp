#include "geometry/separation.hpp"

#include <limits>

#include "check/check.hpp"

namespace fathom {
namespace {

/// A point of B − A, and the point of A it comes from.
struct Corner {
  Vec3d difference, on_a;
};

/// The minimal set of corners that contains the point nearest to the origin, and that point's weights over them.
struct Simplex {
  Corner corners[4];
  double weights[4] = {};
  int count = 0;

  bool has(Vec3d d) const {
    for (int i = 0; i < count; ++i)
      if (corners[i].difference.x == d.x && corners[i].difference.y == d.y && corners[i].difference.z == d.z)
        return true;
    return false;
  }
  Vec3d on_a() const {
    Vec3d sum;
    for (int i = 0; i < count; ++i) sum += weights[i] * corners[i].on_a;
    return sum;
  }
};

/// A point and its weights over the corners of a simplex.
struct Nearest {
  Vec3d point;
  double weights[4] = {};
};

double square(Vec3d v) { return dot(v, v); }

Nearest of_segment(const Simplex& s, int i, int j) {
  const Vec3d a = s.corners[i].difference, ab = s.corners[j].difference - a;
  const double along = -dot(a, ab), whole = square(ab);
  const double t = along > 0 ? (along < whole ? along / whole : 1) : 0;
  Nearest nearest{a + t * ab};
  nearest.weights[i] = 1 - t;
  nearest.weights[j] = t;
  return nearest;
}

Nearest nearer(const Nearest& a, const Nearest& b) { return square(b.point) < square(a.point) ? b : a; }

/// In the interior if the origin is above it, else on one of the edges.
Nearest of_triangle(const Simplex& s, int i, int j, int k) {
  const Vec3d a = s.corners[i].difference, b = s.corners[j].difference, c = s.corners[k].difference;
  const Vec3d n = cross(b - a, c - a);
  const double area = square(n);
  // Parts of the triangle opposite each corner.
  const double of_a = dot(n, cross(b, c)), of_b = dot(n, cross(c, a)), of_c = dot(n, cross(a, b));
  if (area > 1e-26 * square(b - a) * square(c - a) && of_a >= 0 && of_b >= 0 && of_c >= 0) {
    Nearest nearest{(dot(n, a) / area) * n};
    const double sum = of_a + of_b + of_c;
    nearest.weights[i] = of_a / sum;
    nearest.weights[j] = of_b / sum;
    nearest.weights[k] = of_c / sum;
    return nearest;
  }
  return nearer(nearer(of_segment(s, i, j), of_segment(s, j, k)), of_segment(s, k, i));
}

/// The origin itself if it is inside.
Nearest of_tetrahedron(const Simplex& s) {
  Nearest nearest, inside;
  double least = std::numeric_limits<double>::infinity();
  for (int without = 0; without < 4; ++without) {
    const int i = without == 0 ? 1 : 0, j = without <= 1 ? 2 : 1, k = without <= 2 ? 3 : 2;
    const Vec3d a = s.corners[i].difference;
    const Vec3d n = cross(s.corners[j].difference - a, s.corners[k].difference - a);
    const double origin = -dot(n, a), fourth = dot(n, s.corners[without].difference - a);
    // A face does not separate the origin if the fourth corner is on the same side of it.
    if (origin * fourth > 0) {
      inside.weights[without] = origin / fourth;
      continue;
    }
    const Nearest of_face = of_triangle(s, i, j, k);
    if (square(of_face.point) >= least) continue;
    least = square(of_face.point);
    nearest = of_face;
  }
  return least < std::numeric_limits<double>::infinity() ? nearest : inside;
}

/// Reduces the simplex to the corners that its nearest point depends on; returns that point.
Vec3d reduce(Simplex& s) {
  Nearest nearest{s.corners[0].difference, {1}};
  if (s.count == 2) nearest = of_segment(s, 0, 1);
  if (s.count == 3) nearest = of_triangle(s, 0, 1, 2);
  if (s.count == 4) nearest = of_tetrahedron(s);
  int kept = 0;
  for (int i = 0; i < s.count; ++i)
    if (nearest.weights[i] > 0) {
      s.weights[kept] = nearest.weights[i];
      s.corners[kept++] = s.corners[i];
    }
  s.count = kept;
  return nearest.point;
}

/// A common point of two touching balls about the cores' nearest points, `distance` apart along `n`.
Vec3d common_point(Vec3d on_core, Vec3d n, double distance, double radius_a, double radius_b) {
  return on_core + std::clamp(0.5 * (distance - radius_b + radius_a), 0.0, distance) * n;
}

}  // namespace

Separation separation(const PlacedShape& a, const PlacedShape& b, Vec3d shift, Vec3d guess) {
  constexpr int max_rounds = 64;
  const Vec3d between = (b.position - a.position) + shift;
  Vec3d n = guess;
  double size = length(n);
  n = size > 0 ? (1 / size) * n : Vec3d{0, 0, 1};
  Simplex simplex, best;
  double least = std::numeric_limits<double>::infinity(), scale = 0;
  Vec3d nearest = n;
  for (int round = 0; round < max_rounds; ++round) {
    const Vec3d on_a = a.support(n), difference = between + b.support(-n) - on_a;
    if (simplex.has(difference)) break;
    scale = std::max({scale, length(difference), length(on_a)});
    // No point is nearer than this along n.
    if (best.count > 0 && least - dot(n, difference) <= 1e-13 * least + 1e-15 * scale) break;
    simplex.corners[simplex.count++] = {difference, on_a};
    const Vec3d next = reduce(simplex);
    size = length(next);
    // Stop when rounding prevents further progress.
    if (size >= least) break;
    least = size;
    nearest = next;
    best = simplex;
    if (simplex.count == 4 || size <= 1e-15 * scale) break;
    n = (1 / size) * next;
  }
  FATHOM_ASSERT(best.count > 0);
  const Vec3d on_core = best.on_a();
  const double radii = a.radius + b.radius;
  // Rounding error of everything that the positions were computed from.
  const double rounding = 1e-14 * (scale + radii);
  n = least > rounding ? (1 / least) * nearest : Vec3d{};
  if (least <= radii + rounding) {
    const Vec3d common = common_point(on_core, n, least, a.radius, b.radius);
    return {0, common, common, {}};
  }
  return {least - radii, on_core + a.radius * n, on_core + (least - b.radius) * n, n};
}

}  // namespace fathom
