// When two bodies touch and when they hit each other, as reported to the application. Contacts begin before bodies
// meet, because the solver has to stop them at the surface; that is not a touch yet. Pure, for host and device.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

#include "dynamics/bounds.hpp"
#include "dynamics/contact_rows.hpp"
#include "dynamics/tuning.hpp"

namespace fathom {

/// How often a millimetre is halved to get the distance at which bodies touch without pressing: until it is at most a
/// hundredth of the smaller body's bounding radius (m). Contacts store this count in four bits.
FATHOM_HD std::uint32_t touch_halvings(float smaller_radius) {
  std::uint32_t halvings = 0;
  for (float radius = 0.1f; halvings < 15 && radius > smaller_radius; radius *= 0.5f) ++halvings;
  return halvings;
}

/// m. Bodies that already touch keep touching at a larger distance.
FATHOM_HD float touch_distance(std::uint32_t halvings, bool touched) {
  const float halved = __builtin_bit_cast(float, (127 - halvings) << 23);
  return (touched ? parting_distance : touching_distance) * halved;
}

/// Where and how fast two bodies hit each other.
struct Hit {
  Vec3 point;               ///< in the world (m)
  Vec3 normal;              ///< in the world, from A to B
  float speed = 0;          ///< approach speed there at the start of the step (m/s); 0: no hit
  bool is_closing = false;  ///< they have met and still approach: the hit continues in the next step
};

/// A body before and after the step; `after` is the solver's result.
struct Stepped {
  Vec3 position, linear, angular;  ///< at the start of the step
  Quat rotation;
  SolverBody after;
};

struct HitRule {
  float threshold;  ///< m/s of approach
  float reach;      ///< m, `touch_distance`
  float dt;         ///< s
};

/// Whether some point approaches faster than `threshold` (m/s).
FATHOM_HD bool approaches(const NormalMotion& velocity, const PointRow* points, int count, float threshold) {
  bool any = false;
  for (int i = 0; i < max_manifold_points; ++i)
    if (i < count) any |= -velocity.at(points[i].x, points[i].y) > threshold;
  return any;
}

/// The fastest of a contact's points that approached faster than the threshold at the start of the step and have met,
/// for a contact with an impulse in this step. A point has met if it ends the step with an impulse, or at the surface
/// according to the solver's rows; one that bounces does so before it gets there (`leaving_speed`) and parts. `ahead`:
/// the arms are those of the impact.
FATHOM_HD Hit fastest_hit(const ContactManifold& m, const ContactFrame& frame, const PointRow* points,
                          const float* impulses, const Stepped& a, const Stepped& b, bool ahead, const HitRule& rule) {
  const ContactAxes axes(frame);
  const SolverBody &end_a = a.after, &end_b = b.after;
  const NormalMotion start = axes.motion(a.linear, a.angular, b.linear, b.angular);
  const NormalMotion end = axes.motion(end_a.linear, end_a.angular, end_b.linear, end_b.angular);
  const NormalMotion moved = axes.motion(end_a.moved, end_a.turned, end_b.moved, end_b.turned);
  Hit hit;
  hit.normal = axes.n;
  for (int i = 0; i < max_manifold_points; ++i) {
    if (i >= m.point_count()) continue;
    const PointRow& p = points[i];
    const float speed = -start.at(p.x, p.y), left = -end.at(p.x, p.y);
    if (!(speed > rule.threshold)) continue;
    const bool has_bounced = m.restitution > 0 && left < 0;
    const float gap = has_bounced ? p.separation : p.separation + moved.at(p.x, p.y);
    const bool has_met = gap <= rule.reach + (has_bounced ? fma(speed, rule.dt, fall_within(rule.dt)) : 0.0f);
    if (!has_met && !(impulses[i] > 0)) continue;
    hit.is_closing |= left > rule.threshold;
    if (!(speed > hit.speed)) continue;
    hit.speed = speed;
    // In a manifold made at the impact, B's anchor belongs to another orientation.
    const Stepped& on = ahead ? a : b;
    const Vec3 arm = rotate(on.rotation, ahead ? m.points[i].anchor_a : m.points[i].anchor_b);
    // The relax sweep slows points that meet in the next step's first substep.
    const float wait = min(max(p.separation, 0.0f) / speed, 2 * rule.dt);
    hit.point = on.position + mul_add(arm, wait, on.linear + cross(on.angular, arm));
  }
  return hit;
}

}  // namespace fathom
