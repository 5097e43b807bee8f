// How fast bodies may be. Pure, for host and device.
#pragma once

#include <fathom/math.hpp>

namespace fathom {

/// Velocities beyond these are cut wherever a substep moves a body by them, and when the step ends.
struct SpeedLimits {
  float linear = 0;   ///< m/s
  float angular = 0;  ///< rad/s
};

/// Of substeps of length h (s): no body turns by more than half a turn in one, beyond which spins cannot be told apart.
FATHOM_HD SpeedLimits speed_limits(float max_linear_speed, float h) { return {max_linear_speed, pi / h}; }

/// `v`, no longer than `most`.
FATHOM_HD Vec3 limited(Vec3 v, float most) {
  const float squared = dot(v, v);
  if (!(squared > most * most)) return v;
  // Scaled first, because the square may have overflowed.
  const float largest = max_component(abs(v));
  const Vec3 scaled{v.x / largest, v.y / largest, v.z / largest};
  return (most / length(scaled)) * scaled;
}

}  // namespace fathom
