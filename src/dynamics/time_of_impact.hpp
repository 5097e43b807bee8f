// When and where two bodies would meet if they keep their velocities. Pure, for host and device.
//
// Conservative advancement (B. Mirtich, "Impulse-based Dynamic Simulation of Rigid Body Systems", 1996, section 2.3;
// along one direction at a time as in Box2D's and Bullet's): shapes separated along a direction cannot meet before
// their velocities along it and the farthest reach of their turning points have used up the distance. Bodies that fly
// without turning pass a plane of contact in one advance.
#pragma once

#include "collision/gap.hpp"
#include "dynamics/rotation.hpp"

namespace fathom {

/// One of two moving bodies.
struct Mover {
  Geometry geometry;
  float radius = 0;  ///< of the bounding sphere (m)
  Pose pose;
  Velocity velocity;
};

/// The pose after `time` (s).
FATHOM_HD Pose advanced(const Pose& pose, const Velocity& v, float time) {
  Pose later = pose;
  later.position = mul_add(pose.position, time, v.linear);
  if (length_squared(v.angular) > 0) later.rotation = turned(pose.rotation, time * v.angular);
  return later;
}

/// Upper bound of the approach speed (m/s) along the unit vector `n` from A to B in world axes, at any orientation. The
/// rounding radius of a shape adds nothing by turning.
FATHOM_HD float max_approach(const Mover& a, const Mover& b, Vec3 n) {
  const auto turning = [n](const Mover& m) {
    return (m.radius - m.geometry.radius) * length(cross(n, m.velocity.angular));
  };
  return dot(n, a.velocity.linear - b.velocity.linear) + (turning(a) + turning(b));
}

/// Clips a box to the region, for precision: sides of a kilometre are rounded by more than a bullet's size. False if
/// nothing is left.
FATHOM_HD bool clip_to(Core& core, const Aabb& region) {
  if (core.hull.vertex_count > 0) return true;
  const Vec3 lower = max(core.middle - core.half, region.lower), upper = min(core.middle + core.half, region.upper);
  if (!(lower.x <= upper.x && lower.y <= upper.y && lower.z <= upper.z)) return false;
  core.half = 0.5f * (upper - lower);
  core.middle = 0.5f * (upper + lower);
  return true;
}

/// The region that `other` may reach within `dt`, in the frame of `of`, with `room` (m) around it.
FATHOM_HD Aabb region_of(const Mover& other, const Mover& of, float dt, float room) {
  const Vec3 from = inverse_transform(of.pose, other.pose.position);
  const Vec3 path = inverse_rotate(of.pose.rotation, dt * (other.velocity.linear - of.velocity.linear));
  // In the frame of a turning body, the other one orbits it.
  const float round = dt * length(of.velocity.angular) * (length(from) + length(path));
  const Aabb way{from + min(path, Vec3{}), from + max(path, Vec3{})};
  return grown(way, 1.01f * (other.radius + room + round));
}

/// The cores of two bodies, clipped to the other's reach.
struct NearCores {
  Core a, b;
  bool meet = false;  ///< false: they cannot reach each other

  FATHOM_HD float radii() const { return a.radius + b.radius; }
};

FATHOM_HD NearCores near_cores(const Mover& a, const Mover& b, float dt, float skin) {
  NearCores cores{core_of(a.geometry), core_of(b.geometry)};
  const float room = cores.radii() + skin;
  const Aabb way_of_b = region_of(b, a, dt, room), way_of_a = region_of(a, b, dt, room);
  cores.meet = clip_to(cores.a, way_of_b) && clip_to(cores.b, way_of_a);
  return cores;
}

/// Support points of two cores along a direction from A to B, relative to each body's centre, in world axes.
struct SupportPair {
  Vec3 on_a, on_b;
};
FATHOM_HD SupportPair supports_along(const NearCores& cores, const Pose& a, const Pose& b, Vec3 n) {
  return {rotate(a.rotation, support(cores.a, inverse_rotate(a.rotation, n))),
          rotate(b.rotation, support(cores.b, -inverse_rotate(b.rotation, n)))};
}
FATHOM_HD float separation_along(const NearCores& cores, const Pose& a, const Pose& b, const SupportPair& at, Vec3 n) {
  return dot(n, (b.position - a.position) + (at.on_b - at.on_a)) - cores.radii();
}

/// Separation (m) of shapes at these poses along the unit vector `n` from A to B in world axes.
FATHOM_HD float separation_along(const NearCores& cores, const Pose& a, const Pose& b, Vec3 n) {
  return separation_along(cores, a, b, supports_along(cores, a, b, n), n);
}

/// Upper bound of the speed (m/s) at which turning at a constant angular velocity moves any point of a core forward
/// along `n` over the next `span` (s); `height` (m) is that of its support point now.
///
/// After t the height of a point p along n is n·p + t (n × ω)·p, to within ω²t²/2 |p|. So the support point along n + t
/// n × ω bounds all points, and its height is convex in t.
FATHOM_HD float turning_forward(const Core& core, Quat rotation, Vec3 angular, float reach, Vec3 n, float height,
                                float span) {
  const Vec3 change = cross(n, angular);
  const Vec3 later = mul_add(n, span, change);
  const float highest = dot(later, rotate(rotation, support(core, inverse_rotate(rotation, later))));
  const float bent = 0.5f * span * length_squared(angular) * reach;
  return min(reach * length(change), (highest - height) / span + bent);
}

/// Bounds how much nearer two bodies can come along a direction within a time. Turning moves no point beyond the
/// bounding sphere.
struct Approach {
  float straight;             ///< m/s
  float turning_a, within_a;  ///< m/s, and the limit (m) in all
  float turning_b, within_b;

  /// From these poses on, over the time `span` > 0 (s).
  FATHOM_HD Approach(const Mover& a, const Mover& b, const NearCores& cores, const Pose& pose_a, const Pose& pose_b,
                     const SupportPair& at, Vec3 n, float span)
      : straight(dot(n, a.velocity.linear - b.velocity.linear)) {
    const float reach_a = a.radius - a.geometry.radius, reach_b = b.radius - b.geometry.radius;
    const float height_a = dot(n, at.on_a), height_b = -dot(n, at.on_b);
    turning_a = turning_forward(cores.a, pose_a.rotation, a.velocity.angular, reach_a, n, height_a, span);
    turning_b = turning_forward(cores.b, pose_b.rotation, b.velocity.angular, reach_b, -n, height_b, span);
    within_a = max(reach_a - height_a, 0.0f);
    within_b = max(reach_b - height_b, 0.0f);
  }

  /// Time (s) before which they cannot approach by `distance` > 0 (m); 3e38 if they never can.
  FATHOM_HD float time_for(float distance) const {
    const bool is_a_first = turning_a > 0 && within_a * turning_b <= within_b * turning_a;
    const float turning[] = {is_a_first ? turning_a : turning_b, is_a_first ? turning_b : turning_a, 0};
    const float within[] = {is_a_first ? within_a : within_b, is_a_first ? within_b : within_a, 0};
    float speed = straight + (turning_a + turning_b), turned = 0;
    // First turning brings both forward, then one, then neither.
    for (int i = 0; i < 3; ++i) {
      if (!(speed > 0)) return 3e38f;
      const float time = (distance - turned) / speed;
      if (turning[i] * time <= within[i]) return time;
      turned += within[i];
      speed -= turning[i];
    }
    return 3e38f;
  }
};

/// Upper bound of the approach speed (m/s) along an axis that is `n` now and turns with the angular velocity `turn`
/// (rad/s), over the time `span` > 0 (s) from these poses on. Where bodies turn past each other, their axis of greatest
/// separation turns too, and along it they approach far more slowly than along a fixed axis.
///
/// Along an axis n that turns with W, the offset d between the centres changes at the rate n·(v − W × d), where v is
/// the bodies' relative velocity; the rate of change of that is 2 (W × n)·v − (W × n)·(W × d). A point p of a body that
/// turns with ω moves at ((W − ω) × n)·p, which changes at a rate of at most |W − ω| (|W| + |ω|) |p|.
FATHOM_HD float approach_along(const Mover& a, const Mover& b, const NearCores& cores, const Pose& pose_a,
                               const Pose& pose_b, const SupportPair& at, Vec3 n, Vec3 turn, float span) {
  const Vec3 way = pose_b.position - pose_a.position, velocity = b.velocity.linear - a.velocity.linear;
  const float rate = length(turn);
  const auto forward = [&](const Mover& m, const Core& core, Quat rotation, Vec3 towards, float height) {
    const Vec3 relative = turn - m.velocity.angular, later = mul_add(towards, span, cross(relative, towards));
    const float highest = dot(later, rotate(rotation, support(core, inverse_rotate(rotation, later))));
    const float reach = m.radius - m.geometry.radius, turning = length(relative);
    const float bent = 0.5f * span * turning * (rate + length(m.velocity.angular)) * reach;
    return min(reach * turning, (highest - height) / span + bent);
  };
  const float bent = 0.5f * span * rate * fma(2, length(velocity), rate * fma(span, length(velocity), length(way)));
  return dot(n, cross(turn, way) - velocity) + bent + forward(a, cores.a, pose_a.rotation, n, dot(n, at.on_a)) +
         forward(b, cores.b, pose_b.rotation, -n, -dot(n, at.on_b));
}

/// Time (s) for which bodies at these poses cannot approach by `distance` > 0 (m), along an axis that is fixed, that
/// keeps turning (`turn`, rad/s), or that turns with either body; it may exceed `left`. Over shorter spans the bounds
/// are tighter.
FATHOM_HD float time_apart(const Mover& a, const Mover& b, const NearCores& cores, const Pose& pose_a,
                           const Pose& pose_b, const SupportPair& at, Vec3 n, Vec3 turn, float left, float distance) {
  constexpr int max_looks = 3;
  constexpr float longer = 4;
  const Vec3 turns[] = {turn, a.velocity.angular, b.velocity.angular};
  float span = left, safe = 0;
  for (int i = 0; i < max_looks; ++i) {
    float time = Approach(a, b, cores, pose_a, pose_b, at, n, span).time_for(distance);
    for (int k = 0; k < 3 && time < span; ++k) {
      const float speed = approach_along(a, b, cores, pose_a, pose_b, at, n, turns[k], span);
      time = max(time, speed > 0 ? distance / speed : 3e38f);
    }
    if (time >= span) return i == 0 ? time : span;
    safe = max(safe, time);
    span = longer * safe;
    if (!(span < left)) break;
  }
  return safe;
}

/// An approximate direction of greatest separation, in world axes, of shapes at these poses.
FATHOM_HD Vec3 direction_apart(const NearCores& cores, const Pose& a, const Pose& b, Vec3 guess, float tolerance) {
  const Vec3 local = inverse_rotate(a.rotation, guess);
  return rotate(a.rotation, gap_between(cores.a, cores.b, make_frame(relative(a, b)), local, tolerance).normal);
}

struct Impact {
  bool meets = false;
  float time = 0;   ///< s from now
  float gap = 0;    ///< m left then, a lower bound
  float speed = 0;  ///< m/s, upper bound of the approach speed along the gap then
  Vec3 normal;      ///< of the gap, from A to B, in world axes
};

/// Whether, and when first, the bodies get closer to each other than `skin` (m) within `dt` (s). `guess`: approximate
/// direction from A to B in world axes.
FATHOM_HD Impact first_impact(const Mover& a, const Mover& b, const NearCores& cores, float dt, float skin,
                              Vec3 guess) {
  constexpr int max_advances = 48;  // only fast spins and grazing round shapes take more than six
  Impact impact;
  if (!cores.meet) return impact;
  impact.normal = guess;
  Vec3 turn, former;  // rad/s of the axis, and the axis itself at the advance before
  float since = 0;    // s since the axis was `former`
  for (int i = 0; i < max_advances; ++i) {
    const Pose at_a = advanced(a.pose, a.velocity, impact.time), at_b = advanced(b.pose, b.velocity, impact.time);
    const Vec3 local = inverse_rotate(at_a.rotation, impact.normal);
    const float left = dt - impact.time;
    // Many directions show that they pass, long before the search finds that of greatest separation.
    const auto shows = [&](const Gap& found) {
      const float gap = found.distance - cores.radii();
      if (!(gap > skin)) return false;
      const Vec3 n = rotate(at_a.rotation, found.normal);
      const SupportPair at = supports_along(cores, at_a, at_b, n);
      return Approach(a, b, cores, at_a, at_b, at, n, left).time_for(gap - 0.5f * skin) >= left;
    };
    const Frame b_in_a = make_frame(relative(at_a, at_b));
    const Gap found = gap_between(cores.a, cores.b, b_in_a, local, 0.1f * skin, shows);
    impact.normal = rotate(at_a.rotation, found.normal);
    const SupportPair at = supports_along(cores, at_a, at_b, impact.normal);
    impact.gap = separation_along(cores, at_a, at_b, at, impact.normal);
    impact.speed = max_approach(a, b, impact.normal);
    if (impact.gap <= skin) break;
    if (i > 0) turn = (1.0f / since) * cross(former, impact.normal);
    const float later = time_apart(a, b, cores, at_a, at_b, at, impact.normal, turn, left, impact.gap - 0.5f * skin);
    impact.time += later;
    if (!(later < left && impact.time < dt)) return impact;
    former = impact.normal, since = later;
  }
  impact.meets = true;
  return impact;
}

}  // namespace fathom
