// Distance between two convex shapes and its direction: GJK. Pure, for host and device.
//
// E. G. Gilbert, D. W. Johnson, S. S. Keerthi, "A Fast Procedure for Computing the Distance Between Complex Objects in
// Three-Dimensional Space", IEEE J. Robotics and Automation 4 (1988); sub-simplices as in C. Ericson, "Real-Time
// Collision Detection" (2005), section 5.1. The result is a bound from the support points along the direction found:
// whatever rounding does to the simplex, the shapes are at least that far apart.
#pragma once

#include "collision/frame.hpp"
#include "collision/support.hpp"
#include "geometry/support.hpp"

namespace fathom {

/// A shape without its radius: a hull, or a box about `middle`, which may be flat, a segment or a point.
struct Core {
  Vec3 middle, half;
  HullView hull;
  float radius = 0;  ///< m, to be added to the core
};

FATHOM_HD Core core_of(const Geometry& g) {
  switch (g.type) {
    case ShapeType::sphere:
      return {{}, {}, {}, g.radius};
    case ShapeType::capsule:
      return {{}, {0, 0, g.half_extents.z}, {}, g.radius};
    case ShapeType::box:
      return {{}, g.half_extents, {}, 0};
    case ShapeType::hull:
    case ShapeType::mesh:
    case ShapeType::height_field:
    case ShapeType::compound:
      break;
  }
  return {{}, {}, g.hull, g.radius};
}

FATHOM_HD Vec3 support(const Core& core, Vec3 d) {
  if (core.hull.vertex_count > 0) return core.hull.vertices[highest_vertex(core.hull, d).vertex];
  const Vec3 h = core.half;
  return core.middle + Vec3{d.x < 0 ? -h.x : h.x, d.y < 0 ? -h.y : h.y, d.z < 0 ? -h.z : h.z};
}

/// Points of B − A: the minimal set that contains the point nearest to the origin.
struct Simplex {
  Vec3 points[4];
  int count = 0;

  FATHOM_HD bool has(Vec3 p) const {
    for (int i = 0; i < count; ++i)
      if (points[i] == p) return true;
    return false;
  }
};

/// The segment's point nearest to the origin; `used` gets a bit for each end that it depends on.
FATHOM_HD Vec3 nearest_of_segment(Vec3 a, Vec3 b, int& used) {
  const Vec3 ab = b - a;
  const float t = -dot(a, ab), whole = length_squared(ab);
  if (!(t > 0)) return used = 1, a;
  if (!(t < whole)) return used = 2, b;
  used = 3;
  return mul_add(a, t / whole, ab);
}

/// The same for a triangle (Ericson 5.1.5).
FATHOM_HD Vec3 nearest_of_triangle(Vec3 a, Vec3 b, Vec3 c, int& used) {
  const Vec3 ab = b - a, ac = c - a;
  const float d1 = -dot(ab, a), d2 = -dot(ac, a);
  if (d1 <= 0 && d2 <= 0) return used = 1, a;
  const float d3 = -dot(ab, b), d4 = -dot(ac, b);
  if (d3 >= 0 && d4 <= d3) return used = 2, b;
  const float d5 = -dot(ab, c), d6 = -dot(ac, c);
  if (d6 >= 0 && d5 <= d6) return used = 4, c;
  const float vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return nearest_of_segment(a, b, used);
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const Vec3 p = nearest_of_segment(a, c, used);
    used = (used & 1) | (used & 2) << 1;
    return p;
  }
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const Vec3 p = nearest_of_segment(b, c, used);
    used <<= 1;
    return p;
  }
  // Along the normal: more precise than barycentric coordinates where the triangle is large.
  used = 7;
  const Vec3 n = cross(ab, ac);
  const float square = length_squared(n);
  return square > 0 ? (dot(n, a) / square) * n : a;
}

/// The same for the simplex, which keeps only the points that the result depends on. Zero where the origin is inside.
FATHOM_HD Vec3 reduce(Simplex& s) {
  Vec3 nearest = s.points[0];
  int used = 1;
  if (s.count == 2) nearest = nearest_of_segment(s.points[0], s.points[1], used);
  if (s.count == 3) nearest = nearest_of_triangle(s.points[0], s.points[1], s.points[2], used);
  if (s.count == 4) {
    nearest = {}, used = 15;
    float least = 3e38f;
    for (int without = 0; without < 4; ++without) {
      const int i = without == 0 ? 1 : 0, j = without <= 1 ? 2 : 1, k = without <= 2 ? 3 : 2;
      const Vec3 a = s.points[i], b = s.points[j], c = s.points[k], n = cross(b - a, c - a);
      // A face does not separate the origin if the fourth point is on the same side of it.
      const float origin = -dot(n, a), fourth = dot(n, s.points[without] - a);
      if (origin * fourth > 0) continue;
      int of_face = 0;
      const Vec3 p = nearest_of_triangle(a, b, c, of_face);
      const float square = length_squared(p);
      if (!(square < least)) continue;
      least = square, nearest = p;
      used = (of_face & 1 ? 1 << i : 0) | (of_face & 2 ? 1 << j : 0) | (of_face & 4 ? 1 << k : 0);
    }
  }
  int kept = 0;
  for (int i = 0; i < 4; ++i)
    if (used >> i & 1) s.points[kept++] = s.points[i];
  s.count = kept;
  return nearest;
}

/// The cores are at least `distance` (m) apart along `normal`, a unit vector in A's frame from A to B; if it is not
/// above zero, they touch or overlap as far as the search could tell.
struct Gap {
  float distance = -3e38f;
  Vec3 normal;
};

/// `b_in_a` is B's pose in A's frame, `guess` a direction from A to B of any length, `tolerance` (m) by how much the
/// distance may fall short. Ends early once `is_enough(gap)`.
template <class IsEnough>
FATHOM_HD Gap gap_between(const Core& a, const Core& b, const Frame& b_in_a, Vec3 guess, float tolerance,
                          const IsEnough& is_enough) {
  constexpr int max_rounds = 32;
  constexpr float relative_tolerance = 1e-3f;
  const auto support_along = [&](Vec3 n) {  // the point of B − A that is lowest along n
    const Vec3 on_b = support(b, -transpose_mul(b_in_a.rotation, n));
    return (b_in_a.position - support(a, n)) + b_in_a.rotation * on_b;
  };
  Gap best;
  Simplex simplex;
  Vec3 n = normalize(guess);
  for (int round = 0; round < max_rounds; ++round) {
    const Vec3 w = support_along(n);
    const float height = dot(n, w);
    if (height > best.distance) {
      best = {height, n};
      if (is_enough(best)) break;
    }
    if (simplex.has(w)) break;
    simplex.points[simplex.count++] = w;
    const Vec3 nearest = reduce(simplex);
    const float distance = length(nearest);
    if (simplex.count == 4 || !(distance > 0.01f * tolerance)) break;
    // Relative to the distance between the surfaces, which may be far smaller than that between large balls' centres.
    const float between = max(distance - (a.radius + b.radius), 0.0f);
    if (distance - best.distance <= relative_tolerance * between + tolerance) break;
    n = (1.0f / distance) * nearest;
  }
  return best;
}

FATHOM_HD Gap gap_between(const Core& a, const Core& b, const Frame& b_in_a, Vec3 guess, float tolerance) {
  return gap_between(a, b, b_in_a, guess, tolerance, [](const Gap&) { return false; });
}

}  // namespace fathom
