// Conservative advancement (B. Mirtich, "Impulse-based Dynamic Simulation of Rigid Body Systems", 1996, section 2.3) of
// a shape that does not rotate. Its distance from a convex shape is then a convex function of the distance moved, and
// advancing by distance over closing speed is Newton's method from below: it never overshoots, and converges
// quadratically, except where shapes graze each other and each round halves the remainder.
#include "check/check.hpp"
#include "geometry/query.hpp"
#include "geometry/separation.hpp"

namespace fathom {

std::optional<SurfaceHit> shape_cast(const PlacedShape& moving, Vec3 translation, const PlacedShape& still,
                                     double limit) {
  constexpr int max_advances = 64;
  const Vec3d way = to_double(translation), from_still = moving.position - still.position;
  const double skin = 1e-6 * std::min(moving.thinnest, still.thinnest);
  const auto hit = [&](double fraction, const Separation& there) {
    return SurfaceHit{static_cast<float>(fraction), to_float(still.position + there.on_a), to_float(there.normal),
                      there.touch()};
  };
  FATHOM_ASSERT(dot(way, way) > 0 && limit <= 1);
  double fraction = 0;
  Separation last;
  Vec3d guess = from_still;
  for (int i = 0; i < max_advances; ++i) {
    const Separation now = separation(still, moving, fraction * way, guess);
    // Rounding may put the last advance onto the surface, where there is no normal: use that of the previous round.
    if (now.touch()) {
      if (i > 0) last.on_a = now.on_a;
      return hit(fraction, i > 0 ? last : now);
    }
    const double closing = -dot(now.normal, way);
    if (closing <= 0) return std::nullopt;
    if (now.distance <= skin) return hit(fraction, now);
    fraction += (now.distance - 0.5 * skin) / closing;
    if (fraction > limit) return std::nullopt;
    guess = now.normal;
    last = now;
  }
  return hit(fraction, last);
}

}  // namespace fathom
