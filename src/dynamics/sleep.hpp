// When a body is slow, and when it is at rest. Pure, for host and device.
//
// An island falls asleep once it has been slow for a while and is supported: a contact acts on each of its bodies, and
// one of these contacts is with something that cannot be pushed. Without that a slow body sinks, rises or drifts, as is
// normal under water; it falls asleep only if it does not move at all.
#pragma once

#include <fathom/world.hpp>

#include "dynamics/tuning.hpp"

namespace fathom {

/// Speed of a body's fastest point (m/s).
FATHOM_HD float speed_of(const Velocity& v, float radius) { return length(v.linear) + length(v.angular) * radius; }

/// Whether a body is slow enough to fall asleep in time. `moved` is the distance (m) that contacts moved it within a
/// step dt (s): being pushed out of another body moves a body without leaving it a velocity.
FATHOM_HD bool is_slow(const Velocity& v, Vec3 moved, float radius, float slow_below, float dt) {
  return speed_of(v, radius) < slow_below && length(moved) < slow_below * dt;
}

/// Damping factor per step dt (s) for the angular velocity of a round body of this radius (m) in contact; `slow_below`
/// is SleepSettings::linear_speed.
FATHOM_HD float rest_factor(const Velocity& v, float radius, float slow_below, float dt) {
  return speed_of(v, radius) < rest_speeds * slow_below ? 1.0f / (1.0f + rest_damping * dt) : 1.0f;
}

}  // namespace fathom
