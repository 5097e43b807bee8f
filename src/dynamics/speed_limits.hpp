// Speed limits of bodies. Pure, for host and device.
#pragma once

#include <fathom/math.hpp>

#include "dynamics/tuning.hpp"

namespace fathom {

/// Velocities are clamped to these wherever a substep moves a body by them, and when the step ends.
struct SpeedLimits {
  float linear = 0;   ///< m/s
  float angular = 0;  ///< rad/s
};

/// The limits for substeps of length h (s).
FATHOM_HD SpeedLimits speed_limits(float max_linear_speed, float h) { return {max_linear_speed, max_turn / h}; }

}  // namespace fathom
