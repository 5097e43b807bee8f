// How fast bodies may be. Pure, for host and device.
#pragma once

#include <fathom/math.hpp>

namespace fathom {

/// Velocities beyond these are cut wherever a substep moves a body by them, and when the step ends.
struct SpeedLimits {
  float linear = 0;   ///< m/s
  float angular = 0;  ///< rad/s
};

/// Angle (rad) by which a body turns within a substep at most. Turns are exact whatever the angle; those of bodies with
/// several principal moments are done in parts, whose number is bounded (dynamics/rotation.hpp).
inline constexpr float max_turn = 16;

/// Of substeps of length h (s).
FATHOM_HD SpeedLimits speed_limits(float max_linear_speed, float h) { return {max_linear_speed, max_turn / h}; }

}  // namespace fathom
