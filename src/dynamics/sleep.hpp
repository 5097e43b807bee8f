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

/// Of the fastest point of a body (m/s).
FATHOM_HD float speed_of(const Velocity& v, float radius) { return length(v.linear) + length(v.angular) * radius; }

}  // namespace fathom
