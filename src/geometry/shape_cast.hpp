// Conservative advancement (B. Mirtich, "Impulse-based Dynamic Simulation of Rigid Body Systems", 1996, section 2.3) of
// a shape that does not rotate, for host and device. Its distance from a convex shape is then a convex function of the
// distance moved, and advancing by distance over closing speed is Newton's method from below: it never overshoots, and
// converges quadratically, except where shapes graze each other and each round halves the remainder.
#pragma once

#include "check/check.hpp"
#include "geometry/gjk.hpp"
#include "geometry/query.hpp"

namespace fathom {

/// `shape_cast`; true: `hit` says where.
FATHOM_HD bool meets_on_way(const PlacedShape& moving, Vec3 translation, const PlacedShape& still, double limit,
                            SurfaceHit& hit) {
  constexpr int max_advances = 64;
  const Vec3d way = to_double(translation), from_still = moving.position - still.position;
  const double skin = 1e-6 * std::min(moving.thinnest, still.thinnest);
  FATHOM_ASSERT(dot(way, way) > 0 && limit <= 1);
  double fraction = 0;
  Separation last;
  Vec3d guess = from_still;
  for (int i = 0; i < max_advances; ++i) {
    const Separation now = separation_of(still, moving, fraction * way, guess);
    // Rounding may put the last advance onto the surface, where there is no normal: use that of the previous round.
    if (now.touch()) {
      if (i == 0) last = now;
      last.on_a = now.on_a;
      break;
    }
    const double closing = -dot(now.normal, way);
    if (closing <= 0) return false;
    last = now;
    if (now.distance <= skin) break;
    fraction += (now.distance - 0.5 * skin) / closing;
    if (fraction > limit) return false;
    guess = now.normal;
  }
  hit = SurfaceHit{static_cast<float>(fraction), to_float(still.position + last.on_a), to_float(last.normal),
                   last.touch()};
  return true;
}

}  // namespace fathom
