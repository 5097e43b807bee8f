// When and where two bodies that move on as they do would meet. Pure, for host and device.
//
// Conservative advancement (B. Mirtich, "Impulse-based Dynamic Simulation of Rigid Body Systems", 1996, section 2.3;
// along one direction at a time as in Box2D's and Bullet's): along a direction in which shapes are apart they cannot
// meet before the distance is used up by their velocities in that direction and by how far turning can bring any of
// their points. Bodies that fly straight pass a plane of contact in one step of it.
#pragma once

#include "collision/gap.hpp"
#include "dynamics/rotation.hpp"

namespace fathom {

/// One of two bodies on its way.
struct Mover {
  Geometry geometry;
  float radius = 0;  ///< of the bounding sphere (m)
  Pose pose;
  Velocity velocity;
};

/// Where it is after `time` (s).
FATHOM_HD Pose advanced(const Pose& pose, const Velocity& v, float time) {
  Pose later = pose;
  later.position = mul_add(pose.position, time, v.linear);
  if (length_squared(v.angular) > 0) later.rotation = turned(pose.rotation, time * v.angular);
  return later;
}

/// Speed (m/s) at which the bodies can at most approach along the unit vector `n` from A to B in world axes, whatever
/// way they have turned by then. What is round does not come nearer by turning.
FATHOM_HD float most_approach(const Mover& a, const Mover& b, Vec3 n) {
  const auto turning = [n](const Mover& m) {
    return (m.radius - m.geometry.radius) * length(cross(n, m.velocity.angular));
  };
  return dot(n, a.velocity.linear - b.velocity.linear) + (turning(a) + turning(b));
}

/// The part of a box that lies in the region, for precision: sides of a kilometre are rounded by more than a bullet's
/// size. False where none does.
FATHOM_HD bool clip_to(Core& core, const Aabb& region) {
  if (core.hull.vertex_count > 0) return true;
  const Vec3 lower = max(core.middle - core.half, region.lower), upper = min(core.middle + core.half, region.upper);
  if (!(lower.x <= upper.x && lower.y <= upper.y && lower.z <= upper.z)) return false;
  core.half = 0.5f * (upper - lower);
  core.middle = 0.5f * (upper + lower);
  return true;
}

/// What `other` may reach within `dt`, in the frame of `of`, and `room` (m) around it.
FATHOM_HD Aabb region_of(const Mover& other, const Mover& of, float dt, float room) {
  const Vec3 from = inverse_transform(of.pose, other.pose.position);
  const Vec3 path = inverse_rotate(of.pose.rotation, dt * (other.velocity.linear - of.velocity.linear));
  // Seen from a body that turns, the other goes round it.
  const float round = dt * length(of.velocity.angular) * (length(from) + length(path));
  const Aabb way{from + min(path, Vec3{}), from + max(path, Vec3{})};
  return grown(way, 1.01f * (other.radius + room + round));
}

/// The cores of two bodies, as far as either may reach the other.
struct NearCores {
  Core a, b;
  bool meet = false;  ///< false: neither does

  FATHOM_HD float radii() const { return a.radius + b.radius; }
};

FATHOM_HD NearCores near_cores(const Mover& a, const Mover& b, float dt, float skin) {
  NearCores cores{core_of(a.geometry), core_of(b.geometry)};
  const float room = cores.radii() + skin;
  const Aabb way_of_b = region_of(b, a, dt, room), way_of_a = region_of(a, b, dt, room);
  cores.meet = clip_to(cores.a, way_of_b) && clip_to(cores.b, way_of_a);
  return cores;
}

/// How far shapes at these poses are apart along the unit vector `n` from A to B in world axes (m).
FATHOM_HD float separation_along(const NearCores& cores, const Pose& a, const Pose& b, Vec3 n) {
  const Vec3 on_a = support(cores.a, inverse_rotate(a.rotation, n));
  const Vec3 on_b = support(cores.b, -inverse_rotate(b.rotation, n));
  const Vec3 between = (b.position - a.position) + (rotate(b.rotation, on_b) - rotate(a.rotation, on_a));
  return dot(n, between) - cores.radii();
}

/// A direction in world axes along which shapes at these poses are apart, about the one in which they are most.
FATHOM_HD Vec3 direction_apart(const NearCores& cores, const Pose& a, const Pose& b, Vec3 guess, float tolerance) {
  const Vec3 local = inverse_rotate(a.rotation, guess);
  return rotate(a.rotation, gap_between(cores.a, cores.b, make_frame(relative(a, b)), local, tolerance).normal);
}

struct Impact {
  bool meets = false;
  float time = 0;   ///< s from now
  float gap = 0;    ///< m that is left then, at least
  float speed = 0;  ///< m/s at which they can at most approach then along the gap
  Vec3 normal;      ///< of the gap, from A to B, in world axes
};

/// Whether the bodies come nearer to each other than `skin` (m) within `dt` (s), and when first. `guess`: about the
/// direction from A to B in world axes.
FATHOM_HD Impact first_impact(const Mover& a, const Mover& b, const NearCores& cores, float dt, float skin,
                              Vec3 guess) {
  constexpr int most_advances = 48;  // only what turns fast or grazes round things takes more than six
  Impact impact;
  if (!cores.meet) return impact;
  impact.normal = guess;
  for (int i = 0; i < most_advances; ++i) {
    const Pose at_a = advanced(a.pose, a.velocity, impact.time), at_b = advanced(b.pose, b.velocity, impact.time);
    const Vec3 local = inverse_rotate(at_a.rotation, impact.normal);
    // Many a direction shows that they pass, long before the one in which they are most apart is found.
    const auto shows = [&](const Gap& found) {
      const float gap = found.distance - cores.radii();
      if (!(gap > skin)) return false;
      const float speed = most_approach(a, b, rotate(at_a.rotation, found.normal));
      return speed * (dt - impact.time) < gap - 0.5f * skin;
    };
    const Frame b_in_a = make_frame(relative(at_a, at_b));
    const Gap found = gap_between(cores.a, cores.b, b_in_a, local, 0.1f * skin, shows);
    impact.normal = rotate(at_a.rotation, found.normal);
    impact.gap = separation_along(cores, at_a, at_b, impact.normal);
    impact.speed = most_approach(a, b, impact.normal);
    if (impact.gap <= skin) break;
    const float later = impact.gap - 0.5f * skin;
    if (!(impact.speed * (dt - impact.time) > later)) return impact;
    impact.time += later / impact.speed;
  }
  impact.meets = true;
  return impact;
}

}  // namespace fathom
