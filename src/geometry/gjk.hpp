// GJK in double precision, for queries on host and device. Pure.
//
// E. G. Gilbert, D. W. Johnson, S. S. Keerthi, "A Fast Procedure for Computing the Distance Between Complex Objects in
// Three-Dimensional Space", IEEE J. Robotics and Automation 4 (1988); sub-simplices as in C. Ericson, "Real-Time
// Collision Detection" (2005), section 5.1. The step uses a single-precision version (collision/gap.hpp) that returns
// bounds, but no points.
#pragma once

#include "check/check.hpp"
#include "geometry/distance_simplex.hpp"
#include "geometry/separation.hpp"

namespace fathom {

/// A common point of two touching balls about the cores' nearest points, `distance` apart along `n`.
FATHOM_HD Vec3d common_point(Vec3d on_core, Vec3d n, double distance, double radius_a, double radius_b) {
  const double along = 0.5 * (distance - radius_b + radius_a);
  return on_core + (along < 0 ? 0 : distance < along ? distance : along) * n;
}

/// `separation`.
FATHOM_HD Separation separation_of(const PlacedShape& a, const PlacedShape& b, Vec3d shift, Vec3d guess) {
  constexpr int max_rounds = 64;
  const Vec3d between = (b.position - a.position) + shift;
  Vec3d n = guess;
  double size = length(n);
  n = size > 0 ? (1 / size) * n : Vec3d{0, 0, 1};
  DistanceSimplex simplex, best;
  double nearest_size = std::numeric_limits<double>::infinity(), scale = 0;
  Vec3d nearest = n;
  for (int round = 0; round < max_rounds; ++round) {
    const Vec3d on_a = a.support(n), difference = between + b.support(-n) - on_a;
    if (simplex.has(difference)) break;
    scale = std::max(scale, std::max(length(difference), length(on_a)));
    // No point is nearer than this along n.
    if (best.count() > 0 && nearest_size - dot(n, difference) <= 1e-13 * nearest_size + 1e-15 * scale) break;
    simplex.add({difference, on_a});
    const Vec3d next = simplex.reduce();
    size = length(next);
    // Stop when rounding prevents further progress.
    if (size >= nearest_size) break;
    nearest_size = size;
    nearest = next;
    best = simplex;
    if (simplex.count() == 4 || size <= 1e-15 * scale) break;
    n = (1 / size) * next;
  }
  FATHOM_ASSERT(best.count() > 0);
  const Vec3d on_core = best.on_a();
  const double radii = a.radius + b.radius;
  // Rounding error of everything that the positions were computed from.
  const double rounding = 1e-14 * (scale + radii);
  n = nearest_size > rounding ? (1 / nearest_size) * nearest : Vec3d{};
  if (nearest_size <= radii + rounding) {
    const Vec3d common = common_point(on_core, n, nearest_size, a.radius, b.radius);
    return {0, common, common, {}};
  }
  return {nearest_size - radii, on_core + a.radius * n, on_core + (nearest_size - b.radius) * n, n};
}
FATHOM_HD Separation separation_of(const PlacedShape& a, const PlacedShape& b) {
  return separation_of(a, b, {}, b.position - a.position);
}

}  // namespace fathom
