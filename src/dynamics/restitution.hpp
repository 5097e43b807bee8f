// How fast two points meet.
#pragma once

#include <fathom/math.hpp>

namespace fathom {

/// Relative speed (m/s, negative: towards each other) with which two points meet that are `gap` (m) apart, from their
/// relative speed and acceleration (m/s²) when the step begins: v² − 2 a s. A body that falls through the gap within
/// the step gains this energy before it bounces; without it every bounce would lose m g times the gap.
FATHOM_HD float meeting_speed(float speed, float acceleration, float gap) {
  if (!(speed < 0.0f)) return speed;
  const float squared = fma(-2.0f * acceleration, max(gap, 0.0f), speed * speed);
  return -fathom::sqrt(max(squared, 0.0f));
}

}  // namespace fathom
