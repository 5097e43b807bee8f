// Where fast bodies end that can both be pushed (look_ahead.hpp). Pure, for host and device.
#pragma once

#include "dynamics/look_ahead.hpp"

namespace fathom {

/// How deep (m) a pair that is `gap` (m) apart as the step begins may end, as in `free_way`.
FATHOM_HD float allowed_depth(float gap, float half) {
  return max(max(2 * entry_of(half), -gap), min(entry_of(half) - gap, pressed_share * half));
}

/// Where a body ends, and whether that is the end that the solver has given it.
struct FreeEnd {
  bool is_free = true;
  Pose pose;
};

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

/// `free_way` of bodies that can both be pushed, from the poses of `a` and `b`: A gets to `end_a`, whatever B does.
/// What is hit beside its centre turns, and comes after what has hit it: B ends in front of the surface that it met,
/// where that has got to. Or it goes with A from where it met it, where that is the shorter way. It is moved alone:
/// velocities and orientations are as they were, and so are momentum and energy, which depends on the orientation of
/// what has several principal moments. What still approach then have a contact in the next step.
template <bool with_hulls = true>
FATHOM_HD FreeEnd free_end(const Mover& a, const Mover& b, const Pose& end_a, const Pose& end_b, const Apart& first,
                           float half, float dt) {
  const Mover on_a{a.geometry, a.radius, a.pose, velocity_between(a.pose, end_a, dt)};
  const Mover on_b{b.geometry, b.radius, b.pose, velocity_between(b.pose, end_b, dt)};
  const float skin = skin_of(a, b, half), allowed = allowed_depth(first.gap, half);
  const NearCores cores{core_of(a.geometry), core_of(b.geometry), true};
  const bool touched = first.gap <= skin;
  float part = 0;  // of their ways, to where they met
  Vec3 normal = first.normal;
  Pose beside = end_b;
  const auto at = [&](const Mover& m, float share) { return advanced(m.pose, m.velocity, share * dt); };
  if (touched) {
    const auto in_front = [&](float share) {
      const Pose at_a = at(on_a, share), at_b = at(on_b, share);
      return apart_carried(cores, a.pose, b.pose, at_a, at_b, normal).gap >= -allowed;
    };
    const auto depth = [&](float share) {
      AxisCache axis;
      const Pose b_in_a = relative(at(on_a, share), at(on_b, share));
      return -nearest_separation(collide_shapes<with_hulls>(a.geometry, b.geometry, b_in_a, 0.0f, axis));
    };
    if (in_front(1)) return {true, end_b};
    // Where it has left the front of the surface it is behind it, or has got round its edge.
    float front = 0, behind = 1;
    while (behind - front > 0x1p-8f) {
      const float middle = 0.5f * (front + behind);
      (in_front(middle) ? front : behind) = middle;
    }
    if (depth(behind) < 0.5f * allowed && depth(1) < allowed) return {true, end_b};
  } else {
    const FreeWay way = free_way<with_hulls>(a, b, end_a, end_b, first, half, dt);
    if (way.is_free) return {true, end_b};
    part = way.part;
    normal = direction_apart(cores, at(on_a, part), at(on_b, part), normal, 0.1f * skin);
    beside.position = end_of(way, b.pose, end_b, dt).position;
  }
  const Pose at_a = at(on_a, part), at_b = at(on_b, part);
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
  return {false, way_to(with_a) < way_to(beside) ? with_a : beside};
}

}  // namespace fathom
