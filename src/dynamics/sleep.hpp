// When a body is slow, and when it is at rest. Pure, for host and device.
//
// An island falls asleep that has been slow for a while and rests: a contact acts on each of its bodies, and one of
// these contacts is with something that cannot be pushed. Whatever is slow without that sinks, rises or drifts: under
// water this is the normal case. It falls asleep only where it does not move at all.
#pragma once

#include <fathom/world.hpp>

namespace fathom {

/// Part of `SleepSettings::linear_speed` up to which a body counts as not moving.
inline constexpr float still_share = 1e-3f;

/// What is round and touches something rolls on forever, where its material has no rolling resistance, or creeps where
/// the ground is not quite level. Up to this many times `SleepSettings::linear_speed` its spin is damped by so much
/// (1/s), so that it comes to rest; PhysX does the like below its stabilization threshold. A ball rolls freely from a
/// slope of 0.5° on.
inline constexpr float rest_speeds = 4, rest_damping = 2;

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
