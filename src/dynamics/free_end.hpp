// End poses of fast pairs of dynamic bodies (free_way.hpp). Pure, for host and device.
#pragma once

#include "dynamics/free_way.hpp"

namespace fathom {

/// End pose of B if its `way`, from `free_way`, is not free. A body hit off its centre turns and may follow the body
/// that hit it. B therefore ends in front of the surface that it met, at that surface's end pose, or moves along with A
/// from where they met, whichever end is nearer. Only B's position changes: velocities and orientations stay, and with
/// them momentum and energy, which depends on orientation if principal moments differ. Bodies that still approach have
/// a contact in the next step.
FATHOM_HD Pose end_beside(const FreeWay& way, const Mover& a, const Mover& b, const Pose& end_a, const Pose& end_b,
                          const Apart& first, float half, float dt) {
  const float skin = skin_of(a, b, half), allowed = allowed_depth(first.gap, half);
  const NearCores cores{core_of(a.geometry), core_of(b.geometry), true};
  Vec3 normal = first.normal;
  Pose at_a = a.pose, at_b = b.pose, beside = end_b;  // where they met
  if (first.gap > skin) {
    at_a = advanced(a.pose, velocity_between(a.pose, end_a, dt), way.part * dt);
    at_b = advanced(b.pose, velocity_between(b.pose, end_b, dt), way.part * dt);
    normal = direction_apart(cores, at_a, at_b, normal, 0.1f * skin);
    beside.position = end_of(way, b.pose, end_b, dt).position;
  }
  const auto lifted = [&](Pose end) {
    const Apart apart = apart_carried(cores, at_a, at_b, end_a, end, normal);
    // Otherwise rounding could put it inside again.
    end.position = mul_add(end.position, max(skin - allowed - apart.gap, 0.0f), apart.normal);
    return end;
  };
  beside = lifted(beside);
  Pose with_a = end_b;
  with_a.position = transform(end_a, inverse_transform(at_a, at_b.position));
  with_a = lifted(with_a);
  const auto way_to = [&](const Pose& end) { return length_squared(end.position - end_b.position); };
  return way_to(with_a) < way_to(beside) ? with_a : beside;
}

}  // namespace fathom
