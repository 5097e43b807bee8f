// How fast bodies meet and fly.
#pragma once

#include <fathom/math.hpp>

namespace fathom {

/// Relative speed (m/s, negative: towards each other) with which two points meet that had the relative speed `start`
/// when the step began and have since closed `gap` ≥ 0 (m) under a relative acceleration (m/s²): v² − 2 a s. A body
/// that falls through the gap gains this energy before it bounces; without it every bounce would lose m g times the
/// gap.
FATHOM_HD float meeting_speed(float start, float acceleration, float gap) {
  if (!(start < 0.0f)) return start;
  return -fathom::sqrt(max(fma(-2.0f * acceleration, gap, start * start), 0.0f));
}

/// Mean velocity (m/s) of a substep of length h. Where contacts act it is that at the substep's end (symplectic Euler,
/// which contacts need); a body that nothing touched, `velocity` being what integration alone made it, flies on an
/// exact parabola.
FATHOM_HD Vec3 mean_velocity(bool touched, Vec3 velocity, Vec3 acceleration, float h) {
  return touched ? velocity : mul_add(velocity, -0.5f * h, acceleration);
}

}  // namespace fathom
