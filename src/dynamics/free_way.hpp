// How far fast bodies (look_ahead.hpp) may move towards the end poses from the solver. Pure, for host and device.
#pragma once

#include "dynamics/forces.hpp"
#include "dynamics/look_ahead.hpp"

namespace fathom {

/// Where a body may go instead of the end pose from the solver.
struct FreeWay {
  bool is_free = true;  ///< the whole way to that end
  float part = 1;       ///< share of the way that is free
  Vec3 aside;           ///< m, offset from the end of that part
  Vec3 normal;          ///< of the contact that stops it, from A to B
  /// The body ended too deep and is lifted: its deepest point comes to `at` (m, world).
  bool is_lifted = false;
  Vec3 at;

  /// Lifts B by `height` (m) along `along`.
  FATHOM_HD void lift(const NearCores& cores, const Pose& end_a, const Pose& end_b, Vec3 along, float height) {
    is_free = false, is_lifted = true;
    normal = along;
    aside = height * along;
    const Vec3 deepest = supports_along(cores, end_a, end_b, along).on_b - cores.b.radius * along;
    at = end_b.position + deepest + aside;
  }
};

/// Penetration (m) allowed at the end of the step for a pair with separation `gap` (m) at its beginning: a load may
/// press a body a little deeper into its support.
FATHOM_HD float allowed_depth(float gap, float half) {
  return max(max(2 * entry_of(half), -gap), min(entry_of(half) - gap, pressed_share * half));
}

/// Separation of two bodies at `end_a` and `end_b` along the direction that was `normal` at `a` and `b`. It has turned
/// with the body whose face normal it is, or, between edges, with neither: the candidate with the largest separation
/// counts. A candidate turned by more than 60° does not tell the side: a body that spins half a turn on its way through
/// a floor would be separated from it on the other side.
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

/// How exactly a body is held back. Lifted a little farther than necessary it stays outside in spite of rounding, but
/// where bodies are jammed between two others, a lift from one presses them into the other.
enum class HoldBack : std::uint8_t { with_room, jammed };

/// Rounds of attempts to hold a body back from everything on its way: from `jammed_from` on without room, from
/// `turned_back_from` on with the orientation, and from `moved_back_from` on from the pose, with which the step began.
inline constexpr int jammed_from = 2, turned_back_from = 4, moved_back_from = 6, hold_back_rounds = 8;

/// How a round holds back, and the round after it. Bodies with joints get room until they are moved back: a torn joint
/// would drag them along in their jam, and shake them.
FATHOM_HD HoldBack how_in(int round, bool has_joints) {
  return round < (has_joints ? moved_back_from : jammed_from) ? HoldBack::with_room : HoldBack::jammed;
}
FATHOM_HD int round_after(int round, bool has_joints) {
  return has_joints && round + 1 == turned_back_from ? moved_back_from : round + 1;
}

/// Whether moving bodies that touched as the step began end behind or inside each other.
template <bool with_hulls = true>
FATHOM_HD bool gets_behind(const NearCores& cores, const Mover& on_a, const Mover& on_b, const Apart& first,
                           float allowed, float dt) {
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
  // Once it leaves the front of the surface, it is behind it or has moved around its edge.
  float front = 0, behind = 1;
  while (behind - front > 0x1p-8f) {
    const float middle = 0.5f * (front + behind);
    (in_front(middle) ? front : behind) = middle;
  }
  // One call site for both depths, as in `free_way`.
  float most = 0.5f * allowed;
  while (depth(behind) < most) {
    if (behind == 1) return false;
    behind = 1;
    most = allowed;
  }
  return true;
}

/// How far a fast pair may move from the poses of `a` and `b` to `end_a` and `end_b`: all the way, unless they end
/// inside or behind each other. A always reaches `end_a`. The solver sees the impacts of bodies that move straight;
/// impacts after a deflection within the step are found here and become contacts of the next step. B moves on with the
/// body that it meets, and along its surface. A pair may touch before the step and still get deeper or through, because
/// corners turn too fast for the solver or because of a load. Such a pair is lifted out of the surface (`stopped` gives
/// its velocity), not stopped: held where it is too deep, it would be pushed out forever and never get out. `first` is
/// that of `look_ahead`.
template <bool with_hulls = true>
FATHOM_HD FreeWay free_way(const Mover& a, const Mover& b, const Pose& end_a, const Pose& end_b, const Apart& first,
                           float half, float dt, HoldBack how = HoldBack::with_room) {
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
    const bool is_jammed = how == HoldBack::jammed;
    const float rounding = jammed_slack * (length(b.pose.position - a.pose.position) + half);
    const float tolerated = is_jammed ? allowed + rounding : allowed;
    if (end_gap >= -tolerated || !gets_behind<with_hulls>(cores, on_a, on_b, first, tolerated, dt)) return way;
    way.lift(cores, end_a, end_b, normal, (is_jammed ? 0 : skin) - allowed - end_gap);
    return way;
  }
  // B moves on with the surface that it meets (or it would run B over), and along it. An arm that turns pushes B,
  // though the arm's centre rests.
  const auto goes_on = [&](Vec3 along) {
    const Pose at_a = advanced(on_a.pose, on_a.velocity, way.part * dt);
    const Pose at_b = advanced(on_b.pose, on_b.velocity, way.part * dt);
    const Vec3 deepest = supports_along(cores, at_a, at_b, along).on_b - cores.b.radius * along;
    const Vec3 of_surface =
        on_a.velocity.linear + cross(on_a.velocity.angular, at_b.position + deepest - at_a.position);
    const float approach = max(dot(along, of_surface - on_b.velocity.linear), 0.0f);
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
  // The end of the way is tested first: beyond half a turn, the two poses do not tell the direction of rotation. A
  // single call site serves this test and the bisection, in a loop of unknown trip count: SYCL compilers unroll a loop
  // of eight and inline every call, which takes them minutes.
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

/// End pose of a body that moves from `begin` towards `end` as far as its way is free.
FATHOM_HD Pose end_of(const FreeWay& way, const Pose& begin, const Pose& end, float dt) {
  Pose pose = way.part < 1 ? advanced(begin, velocity_between(begin, end, dt), way.part * dt) : end;
  pose.position += way.aside;
  pose.reserved = end.reserved;
  return pose;
}

/// Velocity of B after a lift: the impact of its deepest point on A removes the approach velocity there, and the piece
/// centred at `centre` (m, world) does not approach either. A lift adds height, and a body that kept its spin would
/// land on its corners again and again: small capsules and splinters, alone on a floor, would spin faster and faster.
/// Pose, mass and inertia are B's; `of_a` and `end_of_a` are those of A at its end.
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

/// Angular velocity (rad/s) of a body that `end_of` turns from `from` to `to`: kept in the body frame, and with it the
/// energy. Kept in world axes, the spin of a thin rod about its long axis would turn the rod end over end.
FATHOM_HD Vec3 spin_put_back(Vec3 angular, Quat from, Quat to) { return rotate(to, inverse_rotate(from, angular)); }

}  // namespace fathom
