// Motion of one body within a step: velocities, free movement, limits. Pure, for host and device. The law is in
// dynamics/integrate-inl.hpp.
#pragma once

#include "dynamics/lane_scalar.hpp"
#include "dynamics/solver_body.hpp"
#include "dynamics/speed_limits.hpp"

namespace fathom {

#define FATHOM_LANE_FUNCTION FATHOM_HD
#define FATHOM_LANE_LAMBDA
#include "dynamics/angle-inl.hpp"
#include "dynamics/integrate-inl.hpp"
#include "dynamics/limited-inl.hpp"
#undef FATHOM_LANE_FUNCTION
#undef FATHOM_LANE_LAMBDA

/// Integration parameters of a dynamic body for substeps of length `h` (s): `gravity` (m/s²) acts on it, and damping is
/// in 1/s.
FATHOM_HD BodyMotion motion_under(Vec3 gravity, float linear_damping, float angular_damping, float h) {
  return {gravity, damping_factor(linear_damping, h), {}, damping_factor(angular_damping, h)};
}

/// Whether no contact has acted on a body whose linear velocity after the solver is `after`: W is what contacts gave it
/// in all substeps but the last, and the reference its velocity in that one before they acted.
FATHOM_HD bool has_flown(const WarmStart& w, Vec3 after) { return w.linear == Vec3{} && after == w.linear_reference; }

/// Clamps velocities to the limits. The cut is not due to contacts, so the references follow. Returns whether the
/// linear velocity was cut.
FATHOM_HD bool slow_down(Vec3& linear, Vec3& angular, WarmStart& warm, SpeedLimits limits) {
  const Vec3 slower = limited(linear, limits.linear), turning_slower = limited(angular, limits.angular);
  const bool is_cut = !(slower == linear);
  if (!is_cut && turning_slower == angular) return false;
  warm.linear_reference += slower - linear;
  warm.angular_reference += turning_slower - angular;
  linear = slower;
  angular = turning_slower;
  return is_cut;
}

}  // namespace fathom
