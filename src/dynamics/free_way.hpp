// How far fast bodies (look_ahead.hpp) may go towards the ends that the solver has given them. Pure, for host and
// device.
#pragma once

#include "dynamics/forces.hpp"
#include "dynamics/look_ahead.hpp"

namespace fathom {

/// Where a body may go in place of the end that the solver has given it.
struct FreeWay {
  bool is_free = true;  ///< to that end
  float part = 1;       ///< of the way
  Vec3 aside;           ///< m, from where that part ends
  Vec3 normal;          ///< of what stops it, from A to B
  /// It was too deep at the end of its way: it is lifted to where its deepest point is `at` (m, world).
  bool is_lifted = false;
  Vec3 at;

  /// By `height` (m) along `along`.
  FATHOM_HD void lift(const NearCores& cores, const Pose& end_a, const Pose& end_b, Vec3 along, float height) {
    is_free = false, is_lifted = true;
    normal = along;
    aside = height * along;
    const Vec3 deepest = supports_along(cores, end_a, end_b, along).on_b - cores.b.radius * along;
    at = end_b.position + deepest + aside;
  }
};

/// How deep (m) a pair that is `gap` (m) apart as the step begins may end: a load may press what it stands on a little
/// deeper than it was.
FATHOM_HD float allowed_depth(float gap, float half) {
  return max(max(2 * entry_of(half), -gap), min(entry_of(half) - gap, pressed_share * half));
}

/// How far two bodies are apart at `end_a` and `end_b` along the direction that was `normal` at `a` and `b`. It has
/// turned with the body whose face it is the normal of, or with neither, where edges met: the one of these along which
/// they are most apart. Turned by more than 60° it says nothing of the side they were on: what spins half round on its
/// way through a floor would be apart from it on the other side.
FATHOM_HD Apart apart_carried(const NearCores& cores, const Pose& a, const Pose& b, const Pose& end_a,
                              const Pose& end_b, Vec3 normal) {
  const Vec3 carried[] = {normal, rotate(end_a.rotation, inverse_rotate(a.rotation, normal)),
                          rotate(end_b.rotation, inverse_rotate(b.rotation, normal))};
  Apart most{normal, -3e38f};
  for (const Vec3 n : carried)
    if (dot(n, normal) > 0.5f)
      if (const float gap = separation_along(cores, end_a, end_b, n); gap > most.gap) most = {n, gap};
  return most;
}

/// Whether bodies on their ways that touched as the step began end behind or inside each other.
template <bool with_hulls = true>
FATHOM_HD bool gets_behind(const NearCores& cores, const Mover& on_a, const Mover& on_b, const Apart& first, float half,
                           float dt) {
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

/// What a fast pair may go of its ways from the poses of `a` and `b` to `end_a` and `end_b`: all of it unless they come
/// out inside or behind each other. A gets to `end_a`, whatever B does. The solver sees where bodies meet that fly
/// straight on; what they meet after that, turned and thrown about within the step, is seen here, and is a contact of
/// the next one. B goes on with what it meets, and along its surface. What touched before and still comes deeper or
/// gets through, by corners that go round too fast for the solver or by what lies on it, is lifted out of the surface
/// (`stopped` says how it goes on). It is not stopped: held where it is too deep it would be pushed out forever and
/// never get out. `first` is that of `look_ahead`.
template <bool with_hulls = true>
FATHOM_HD FreeWay free_way(const Mover& a, const Mover& b, const Pose& end_a, const Pose& end_b, const Apart& first,
                           float half, float dt) {
  FreeWay way;
  const Vec3 normal = first.normal;
  const float gap = first.gap;
  const Mover on_a{a.geometry, a.radius, a.pose, velocity_between(a.pose, end_a, dt)};
  const Mover on_b{b.geometry, b.radius, b.pose, velocity_between(b.pose, end_b, dt)};
  const float skin = skin_of(a, b, half), allowed = allowed_depth(gap, half);
  const NearCores cores = near_cores(on_a, on_b, dt, skin);
  if (!cores.meet) return way;
  const float end_gap = separation_along(cores, end_a, end_b, normal);
  if (end_gap >= -allowed) return way;
  if (gap <= skin) {
    if (!gets_behind<with_hulls>(cores, on_a, on_b, first, half, dt)) return way;
    way.lift(cores, end_a, end_b, normal, skin - allowed - end_gap);  // by rounding it would else be found inside again
    return way;
  }
  // With what it meets it goes on, or that would run over it, and along its surface.
  const auto goes_on = [&](Vec3 along) {
    const float approach = max(dot(along, on_a.velocity.linear - on_b.velocity.linear), 0.0f);
    return ((1 - way.part) * dt) * mul_add(on_b.velocity.linear, approach, along);
  };
  const Impact impact = first_impact(on_a, on_b, cores, dt, skin, normal);
  if (impact.meets && separation_along(cores, end_a, end_b, impact.normal) < -allowed) {
    way.is_free = false;
    way.part = impact.time / dt;
    way.normal = impact.normal;
    way.aside = goes_on(impact.normal);
    return way;
  }
  const auto is_inside = [&](float part) {
    AxisCache axis;
    const Pose at_a = advanced(on_a.pose, on_a.velocity, part * dt);
    const Pose at_b = advanced(on_b.pose, on_b.velocity, part * dt);
    const Pose b_in_a = relative(at_a, at_b);
    return nearest_separation(collide_shapes<with_hulls>(a.geometry, b.geometry, b_in_a, 0.0f, axis)) < -allowed;
  };
  // The end of the way comes first. Of turns beyond half a turn a step's ends do not tell which way they went. There is
  // one call for both, in a loop whose turns cannot be counted: compilers of SYCL kernels unroll a loop of eight and
  // then inline every call, which took them minutes.
  float free = 0, inside = 2;
  while (inside - free > 0x1p-8f) {
    const float middle = 0.5f * (free + inside);
    if (is_inside(middle)) {
      inside = middle;
    } else {
      if (middle == 1) return way;
      free = middle;
    }
  }
  way.is_free = false;
  way.part = free;
  way.normal = normal;
  way.aside = goes_on(normal);
  return way;
}

/// Where a body comes to that goes from `begin` towards `end` as far as its way is free.
FATHOM_HD Pose end_of(const FreeWay& way, const Pose& begin, const Pose& end, float dt) {
  Pose pose = way.part < 1 ? advanced(begin, velocity_between(begin, end, dt), way.part * dt) : end;
  pose.position += way.aside;
  pose.reserved = end.reserved;
  return pose;
}

/// The velocity of B that is lifted: its deepest point has hit A, which takes it the approach it has there, and the
/// piece of it with its centre at `centre` (m, world) does not come nearer. A lift gives a body height, and one that
/// kept its spin would come down on its corners again and again: small capsules and splinters, alone on a floor, spun
/// faster and faster. Poses and masses are B's; those of A are of its end.
FATHOM_HD Velocity stopped(const FreeWay& way, const Velocity& of_a, Vec3 end_of_a, Vec3 centre, Velocity v,
                           const Pose& end_of_b, float inverse_mass, float isotropic, const SymMat3& inverse_inertia) {
  const Vec3 arm = way.at - (end_of_b.position + way.aside), turn = cross(arm, way.normal);
  const Vec3 of_surface = of_a.linear + cross(of_a.angular, way.at - end_of_a);
  const float approach = dot(way.normal, of_surface - (v.linear + cross(v.angular, arm)));
  if (approach > 0) {
    const Vec3 response = angular_response(end_of_b.rotation, isotropic, inverse_inertia, turn);
    const float impulse = approach / (inverse_mass + dot(turn, response));
    v.linear = mul_add(v.linear, impulse * inverse_mass, way.normal);
    v.angular = mul_add(v.angular, impulse, response);
  }
  const Vec3 of_centre = v.linear + cross(v.angular, centre - end_of_b.position);
  v.linear = mul_add(v.linear, max(dot(way.normal, of_a.linear - of_centre), 0.0f), way.normal);
  return v;
}

/// The angular velocity (rad/s) of a body that `end_of` puts from `from` to `to`: its spin stays as the body has it,
/// and with it its energy. What turns a thin rod about its long axis would turn the rod itself if it stayed in world
/// axes.
FATHOM_HD Vec3 spin_put_back(Vec3 angular, Quat from, Quat to) { return rotate(to, inverse_rotate(from, angular)); }

}  // namespace fathom
