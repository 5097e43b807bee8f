// Where fast bodies end that can both be pushed (look_ahead.hpp). Pure, for host and device.
#pragma once

#include "dynamics/look_ahead.hpp"

namespace fathom {

/// How deep (m) a pair that is `gap` (m) apart as the step begins may end, as in `free_way`.
FATHOM_HD float allowed_depth(float gap, float half) {
  return max(max(2 * entry_of(half), -gap), min(entry_of(half) - gap, pressed_share * half));
}

/// How far two bodies are apart at `end_a` and `end_b` along the direction that was `normal` at `a` and `b`. It has
/// turned with the body whose face it is the normal of, or with neither, where edges met: the one of these along which
/// they are most apart.
FATHOM_HD Apart apart_carried(const NearCores& cores, const Pose& a, const Pose& b, const Pose& end_a,
                              const Pose& end_b, Vec3 normal) {
  const Vec3 carried[] = {normal, rotate(end_a.rotation, inverse_rotate(a.rotation, normal)),
                          rotate(end_b.rotation, inverse_rotate(b.rotation, normal))};
  Apart most{normal, -3e38f};
  for (const Vec3 n : carried)
    if (const float gap = separation_along(cores, end_a, end_b, n); gap > most.gap) most = {n, gap};
  return most;
}

/// Whether bodies on their ways that touched as the step began end behind or inside each other.
template <bool with_hulls = true>
FATHOM_HD bool gets_behind(const Mover& on_a, const Mover& on_b, const Apart& first, float half, float dt) {
  const NearCores cores{core_of(on_a.geometry), core_of(on_b.geometry), true};
  const float allowed = allowed_depth(first.gap, half);
  const auto at = [dt](const Mover& m, float part) { return advanced(m.pose, m.velocity, part * dt); };
  const auto in_front = [&](float part) {
    return apart_carried(cores, on_a.pose, on_b.pose, at(on_a, part), at(on_b, part), first.normal).gap >= -allowed;
  };
  const auto depth = [&](float part) {
    AxisCache axis;
    const Pose b_in_a = relative(at(on_a, part), at(on_b, part));
    return -nearest_separation(collide_shapes<with_hulls>(on_a.geometry, on_b.geometry, b_in_a, 0.0f, axis));
  };
  if (in_front(1)) return false;
  // Where it has left the front of the surface it is behind it, or has got round its edge.
  float front = 0, behind = 1;
  while (behind - front > 0x1p-8f) {
    const float middle = 0.5f * (front + behind);
    (in_front(middle) ? front : behind) = middle;
  }
  // One call for both, as in `free_way`.
  float most = 0.5f * allowed;
  while (depth(behind) < most) {
    if (behind == 1) return false;
    behind = 1;
    most = allowed;
  }
  return true;
}

/// `free_way` of bodies that can both be pushed, from the poses of `a` and `b`, of which no velocity counts: A gets to
/// `end_a`, whatever B does. Of bodies that touched as the step began the way is free or not, and no more.
template <bool with_hulls = true>
FATHOM_HD FreeWay way_beside(const Mover& a, const Mover& b, const Pose& end_a, const Pose& end_b, const Apart& first,
                             float half, float dt) {
  if (first.gap > skin_of(a, b, half)) return free_way<with_hulls>(a, b, end_a, end_b, first, half, dt);
  const Mover on_a{a.geometry, a.radius, a.pose, velocity_between(a.pose, end_a, dt)};
  const Mover on_b{b.geometry, b.radius, b.pose, velocity_between(b.pose, end_b, dt)};
  FreeWay way;
  way.is_free = !gets_behind<with_hulls>(on_a, on_b, first, half, dt);
  return way;
}

/// Where B ends whose way, that of `way_beside`, is not free. What is hit beside its centre turns, and comes after what
/// has hit it: B ends in front of the surface that it met, where that has got to. Or it goes with A from where it met
/// it, where that is the shorter way. It is moved alone: velocities and orientations are as they were, and so are
/// momentum and energy, which depends on the orientation of what has several principal moments. What still approach
/// then have a contact in the next step.
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
    // By rounding it would else be found inside again.
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
