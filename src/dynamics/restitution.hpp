// How fast two points meet.
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

}  // namespace fathom
