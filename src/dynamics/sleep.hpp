// When a body is slow, and when it is at rest. Pure, for host and device.
//
// An island falls asleep that has been slow for a while and rests: a contact acts on each of its bodies, and one of
// these contacts is with something that cannot be pushed. Whatever is slow without that sinks, rises or drifts: under
// water this is the normal case. It falls asleep only where it does not move at all.
#pragma once

#include <fathom/world.hpp>

#include "dynamics/tuning.hpp"

namespace fathom {

/// Of the fastest point of a body (m/s).
FATHOM_HD float speed_of(const Velocity& v, float radius) { return length(v.linear) + length(v.angular) * radius; }

/// Whether a body is slow enough to fall asleep in time. `moved` is the way (m) that contacts took it within a step dt
/// (s): what pushes it out of another body moves it without leaving it a velocity.
FATHOM_HD bool is_slow(const Velocity& v, Vec3 moved, float radius, float slow_below, float dt) {
  return speed_of(v, radius) < slow_below && length(moved) < slow_below * dt;
}

/// Factor of a step dt (s) for the angular velocity of a body in contact that is round with this radius (m);
/// `slow_below` is SleepSettings::linear_speed.
FATHOM_HD float rest_factor(const Velocity& v, float radius, float slow_below, float dt) {
  return speed_of(v, radius) < rest_speeds * slow_below ? 1.0f / (1.0f + rest_damping * dt) : 1.0f;
}

}  // namespace fathom
