// Impacts of fast bodies within a step. Pure, for host and device.
//
// A speculative contact separates bodies along the contact normal at the start of the step. For bodies that move by a
// good part of their size within the step this normal is wrong: they meet beside it, or it stops them as they pass each
// other. Such a pair is searched for its time of impact: bodies that pass get no contact, and bodies that meet get the
// contact at the position of impact, with separations that they use up on the way there.
#pragma once

#include "collision/collide.hpp"
#include "collision/tolerance.hpp"
#include "dynamics/bounds.hpp"
#include "dynamics/contact_rows.hpp"
#include "dynamics/manifold_update.hpp"
#include "dynamics/move_to.hpp"
#include "dynamics/time_of_impact.hpp"
#include "dynamics/tuning.hpp"

namespace fathom {

/// `half`: half thickness (m) of the pair's thinner shape. `skin_of`: distance (m) beyond which shapes up to `reach`
/// (m) from their origins are certainly apart. `entry_of`: penetration (m) at which the manifold of an impact is made.
/// At that depth the normal is that of the side which is hit, and an edge that is only brushed, as at the seam of two
/// tiles, does not count.
FATHOM_HD float skin_of(float half, float reach) { return min(max_skin, skin_share * half) + 4e-7f * reach; }
FATHOM_HD float entry_of(float half) { return min(max_axis_tolerance, axis_tolerance_share * half); }

/// Relative movement (m) within a step of a pair with the speculative margin `margin` (m).
FATHOM_HD float movement_of(float margin, float radius_a, float radius_b, float dt) {
  return margin - margin_at_rest(radius_a, radius_b, dt);
}

/// Whether shapes just collided, with the result `seen` and `axis`, cannot meet within the step: along the axis they
/// are farther apart than their speculative margin, which bounds their relative movement (except for turns of more than
/// a radian).
FATHOM_HD bool pass_for_certain(const Manifold& seen, const AxisCache& axis, const Velocity& a, const Velocity& b,
                                float dt) {
  const auto turns_little = [dt](const Velocity& v) { return dt * dt * length_squared(v.angular) <= 1; };
  return seen.count == 0 && axis.separated && turns_little(a) && turns_little(b);
}

enum class Ahead : std::uint8_t {
  as_seen,  ///< the manifold that `collide` made at the current poses
  nothing,  ///< they pass each other
  meets,    ///< `LookAhead::manifold`
};

/// A direction in world axes and the separation `gap` (m) of two bodies along it, negative in penetration.
struct Apart {
  Vec3 normal;
  float gap;
};

struct LookAhead {
  Ahead ahead = Ahead::as_seen;
  bool is_watched = false;  ///< moves far within the step or is pressed in deep: `free_way` looks at its end
  Apart first{};            ///< as the step begins; only for watched pairs
  float time = 0;           ///< s from the step's beginning to the moment at which the manifold was made
  Pose b_in_a;              ///< at that moment
  Manifold manifold;
};

/// Separation at the start of the step: along the normal of the manifold `seen`, unless that separation is less than
/// its points'; then along the better of it and the direction of greatest separation.
FATHOM_HD Apart apart_at_first(const Mover& a, const Mover& b, const NearCores& cores, const Manifold& seen,
                               float skin) {
  const Vec3 guess =
      seen.count > 0 ? rotate(a.pose.rotation, seen.normal) : normalize(b.pose.position - a.pose.position);
  const Apart along{guess, separation_along(cores, a.pose, b.pose, guess)};
  if (along.gap >= nearest_separation(seen) - skin) return along;
  const Vec3 normal = direction_apart(cores, a.pose, b.pose, guess, 0.1f * skin);
  const float gap = separation_along(cores, a.pose, b.pose, normal);
  return gap > along.gap ? Apart{normal, gap} : along;
}

FATHOM_HD float skin_of(const Mover& a, const Mover& b, float half) {
  return skin_of(half, length(b.pose.position - a.pose.position));
}

/// Whether the bodies are pressed so deep into each other that an obstacle must not let the other any deeper. Within a
/// step a joint or heavier bodies may pull a light body in by less than `slow_share` of its thickness, step by step.
FATHOM_HD bool is_pressed(const Manifold& seen, float half) { return nearest_separation(seen) < -pressed_deep * half; }

/// For a pair with the manifold `seen`, which may be empty although the pair is within its speculative margin `margin`:
/// over that distance faces need not face each other. `half`: half thickness (m) of the thinner shape.
template <bool with_hulls = true>
FATHOM_HD LookAhead look_ahead(const Mover& a, const Mover& b, const Manifold& seen, float margin, float half,
                               float dt) {
  LookAhead result;
  const bool is_fast = movement_of(margin, a.radius, b.radius, dt) > slow_share * half;
  result.is_watched = is_fast || is_pressed(seen, half);
  if (!result.is_watched) return result;
  const float entry = entry_of(half), skin = skin_of(a, b, half), nearest = nearest_separation(seen);
  const NearCores cores = near_cores(a, b, dt, skin);
  const Apart first = result.first = apart_at_first(a, b, cores, seen, skin);
  if (!is_fast) return result;
  const Vec3 normal = first.normal;
  const float gap = first.gap;
  const float approach = dt * max_approach(a, b, normal);
  Impact impact{true, 0, gap, approach / dt, normal};
  if (seen.count > 0 && gap <= entry && approach - gap <= 2 * entry) return result;
  if (!cores.meet || (gap > skin && approach < gap - skin))
    impact.meets = false;  // this direction alone shows it
  else if (gap > skin)
    impact = first_impact(a, b, cores, dt, skin, normal);
  if (!impact.meets) {
    const bool is_near = nearest <= min(margin_at_rest(a.radius, b.radius, dt), slow_share * half);
    result.ahead = is_near && approach < gap ? Ahead::as_seen : Ahead::nothing;
    return result;
  }
  const float deeper = max(impact.gap, 0.0f) + entry;
  const bool gets_deep = impact.speed * (dt - impact.time) >= deeper;
  // An impact too late to get that deep does not tell the side yet: at the seam of two tiles it could be the wrong one.
  // The next step will see the bodies touch.
  if (impact.time > 0 && !gets_deep) {
    result.ahead = Ahead::nothing;
    return result;
  }
  result.time = gets_deep ? impact.time + deeper / impact.speed : dt;
  result.b_in_a = relative(advanced(a.pose, a.velocity, result.time), advanced(b.pose, b.velocity, result.time));
  AxisCache axis;
  result.manifold = collide_shapes<with_hulls>(a.geometry, b.geometry, result.b_in_a, margin, axis);
  const bool is_same = seen.count > 0 && impact.time == 0 && dot(seen.normal, result.manifold.normal) > 0.95f;
  if (!is_same) result.ahead = result.manifold.count > 0 ? Ahead::meets : Ahead::nothing;
  return result;
}

/// Brings the rows that `prepare_contact` made at the poses after `time` (s) of free movement back to the step's
/// beginning: adds to each separation the distance by which its point approaches on the way there. Returns the least
/// separation.
template <class Inertia>
FATHOM_HD float count_back(float time, const ContactBodies<Inertia>& bodies, ContactRows& rows) {
  const NormalMotion motion = rows.axes().velocity(bodies);
  float nearest = 3e38f;
  for (int i = 0; i < rows.end(); ++i) {
    if (!rows.has(i)) continue;
    PointRow& p = rows.points[i];
    p.separation = fma(-time, motion.at(p.x, p.y), p.separation);
    nearest = min(nearest, p.separation);
  }
  return nearest;
}

/// `prepare_contact` for a manifold made at the poses that its bodies will have after `time` (s).
template <class Inertia>
FATHOM_HD float prepare_contact_ahead(const ContactManifold& m, const Pose& pose_a, const Pose& pose_b, float time,
                                      bool round, const ContactBodies<Inertia>& bodies, ContactRows& rows) {
  const Pose at_a = advanced(pose_a, {bodies.a.linear, 0, bodies.a.angular, 0}, time);
  const Pose at_b = advanced(pose_b, {bodies.b.linear, 0, bodies.b.angular, 0}, time);
  prepare_contact(m, at_a, at_b, {0, round, 0}, bodies, rows);
  return count_back(time, bodies, rows);
}

}  // namespace fathom
