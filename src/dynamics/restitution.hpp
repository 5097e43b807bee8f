// How fast bodies meet and fly.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

#include "dynamics/solver_body.hpp"

namespace fathom {

/// Sweeps of strikes that a substep has at most: a hit passes on through one body a sweep at least.
inline constexpr std::uint32_t most_strike_sweeps = 8;

/// Adds `change` to a velocity (m/s). `rest` gets what rounding has left out, to be part of the next change (Kahan,
/// "Further remarks on reducing truncation errors", 1965): g h is far less than the velocity it is added to, is rounded
/// the same way in every step of a fall, and is then no longer g.
FATHOM_HD void accelerate(Vec3& velocity, Vec3& rest, Vec3 change) {
  const Vec3 next = velocity + change;
  rest = change - (next - velocity);
  velocity = next;
}

/// Whether a step that changed the velocity (m/s) of a body from `before` to `after` may have been no more than a free
/// flight, in which it becomes `flown`, rounded in each of its substeps.
FATHOM_HD bool may_have_flown(Vec3 before, Vec3 after, Vec3 flown, float substeps) {
  const Vec3 size = abs(before) + abs(flown), off = abs(after - flown);
  const float share = substeps * 6e-8f;  // half an ulp each
  return off.x <= share * size.x && off.y <= share * size.y && off.z <= share * size.z;
}

/// Whether no contact has acted on a body that the solver has brought to the linear velocity `after`: W is what
/// contacts gave it in all substeps but the last, and the reference its velocity before they acted in that.
FATHOM_HD bool has_flown(const WarmStart& w, Vec3 after) { return w.linear == Vec3{} && after == w.linear_reference; }

/// Mean velocity (m/s) of a substep of length h. Where contacts act it is that at the substep's end (symplectic Euler,
/// which contacts need); a body that nothing touched, `velocity` being what integration alone made it, flies on an
/// exact parabola.
FATHOM_HD Vec3 mean_velocity(bool touched, Vec3 velocity, Vec3 acceleration, float h) {
  return touched ? velocity : mul_add(velocity, -0.5f * h, acceleration);
}

}  // namespace fathom
