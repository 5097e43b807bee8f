// How fast bodies meet and fly.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

#include "dynamics/solver_body.hpp"

namespace fathom {

/// Sweeps of strikes that a substep has at most: a hit passes on through one body a sweep at least.
inline constexpr std::uint32_t most_strike_sweeps = 8;

/// Relative speed (m/s, negative: towards each other) with which two points meet that had the relative speed `start`
/// when the step began and have since closed `gap` ≥ 0 (m) under a relative acceleration (m/s²): v² − 2 a s. A body
/// that falls through the gap gains this energy before it bounces; without it every bounce would lose m g times the
/// gap.
FATHOM_HD float meeting_speed(float start, float acceleration, float gap) {
  if (!(start < 0.0f)) return start;
  return -fathom::sqrt(max(fma(-2.0f * acceleration, gap, start * start), 0.0f));
}

/// Speed (m/s) at which two points part that approach with the relative speed `speed` < 0 and, if nothing else happens,
/// meet within a substep of length h: what makes them part with e times the speed at which they meet, seen from where
/// they are. Points that bounce before they meet keep their energy to the last bit of it, wherever in the substep that
/// is. Negative: they do not meet, or more slowly than `threshold`.
FATHOM_HD float leaving_speed(float speed, float separation, float e, float acceleration, float h, float threshold) {
  if (!(fma(fma(acceleration, h, speed), h, separation) <= 0.0f)) return -1;
  const float gap = max(separation, 0.0f), meeting = meeting_speed(speed, acceleration, gap);
  if (!(meeting < -threshold)) return -1;
  const float e_meeting = e * meeting;
  return fathom::sqrt(max(fma(2.0f * acceleration, gap, e_meeting * e_meeting), 0.0f));
}

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
