// Contacts between a mechanism's links and obstacles that the mechanism solves itself (dynamics/mechanism.hpp). Pure,
// for host and device.
//
// A sweep over a contact knows the inertia of its own two bodies. A wheel of 1 kg that carries a tonne through its
// hinge then stops a thousandth of that tonne per sweep, and as soon as the joints are solved it moves again: the car
// hops. So where a link carries much more than its own weight, its contacts are swept once more after the joints, with
// the response of the whole mechanism in place of the link's own inverse inertia. (Robotics knows it as the inverse of
// the operational space inertia: Khatib, "A unified approach for motion and force control of robot manipulators", IEEE
// J. Robotics and Automation 3(1), 1987; recursively along a tree in Kreutz-Delgado, Jain, Rodriguez, "Recursive
// formulation of operational space control", Int. J. Robotics Research 11(4), 1992.)
#pragma once

#include <cstdint>

#include "dynamics/contact_rows.hpp"
#include "dynamics/mechanism_link.hpp"
#include "dynamics/support.hpp"

namespace fathom {

/// Inverse inertia of a link's body with all that its joints connect to it, in the axes of the body's spin.
using LinkResponse = CoupledInertia<float>;

FATHOM_HD LinkResponse link_response(const LinkPushes& p) {
  const auto symmetric = [](Vec3 x, Vec3 y, Vec3 z) { return SymMat3{x.x, y.y, z.z, y.x, z.x, z.y}; };
  const TreeChange(&by)[3] = p.by_moment;
  return {symmetric(p.by_impulse[0].linear, p.by_impulse[1].linear, p.by_impulse[2].linear), by[0].linear, by[1].linear,
          by[2].linear, symmetric(by[0].angular, by[1].angular, by[2].angular)};
}

/// Whether a link's contact is one that its mechanism solves: by the load that its `impulse` (N·s) of the last step
/// shows, in the link's own weight. In a step a fall gains `fall` (m/s). What is welded to a link may press it down
/// hardly at all and yet lean over by far: a lamp post.
FATHOM_HD bool is_for_mechanism(const MechanismLink& link, float impulse, float inverse_mass, float fall) {
  return impulse * inverse_mass > (link.is_welded ? 0.0f : jointed_load * fall);
}

/// A contact of a link, its B, with an obstacle.
struct LinkContact {
  ContactRows rows;  ///< along arms of the step's beginning; masses are those of the response
  ContactStep soft;
  ContactBody<LinkResponse> obstacle;
  ContactSurface surface;
  bool on_surface = false;

  /// Moves it by a substep of length h (s), like the bodies.
  FATHOM_HD void move_obstacle(float h) {
    obstacle.moved = mul_add(obstacle.moved, h, obstacle.linear);
    obstacle.turned = mul_add(obstacle.turned, h, obstacle.angular);
  }
};

/// A contact's impulse over the step so far, `step` (N·s), after the mechanism has changed the sum of its points from
/// `before`, which the substep's last sweep has counted, to `now`. Rounding must not leave less than nothing.
FATHOM_HD float step_impulse_with(float step, float before, float now) { return max(step + (now - before), 0.0f); }

/// What a change of a contact's impulses gives to B, about its centre.
FATHOM_HD Wrench push_on_b(const ContactAxes& axes, const ContactRows& rows, const ContactImpulses& before) {
  NormalMotion sum{0, 0, 0};
  for (int i = 0; i < rows.count; ++i) {
    const float more = rows.impulses.normal[i] - before.normal[i];
    sum.n += more;
    sum.t1 = fma(rows.points[i].y, more, sum.t1);
    sum.t2 = fma(-rows.points[i].x, more, sum.t2);
  }
  const float slide_1 = rows.impulses.slide_1 - before.slide_1, slide_2 = rows.impulses.slide_2 - before.slide_2;
  const Vec3 force = sum.n * axes.n + slide_1 * axes.t1 + slide_2 * axes.t2;
  const Vec3 torque = sum.t1 * axes.t1 + sum.t2 * axes.t2 + (rows.impulses.twist - before.twist) * axes.n;
  return {force, torque + cross(axes.arm_b, force)};
}

/// One sweep over a link's contact; `link` is at its current velocity and gets the impulses. Returns what they give to
/// it, about its centre; nothing where they are not finite. `lead`: see `friction_lead`.
template <ContactPass pass>
FATHOM_HD Wrench sweep_link_contact(LinkContact& contact, ContactBody<LinkResponse>& link, float lead) {
  ContactBodies<LinkResponse> both{contact.obstacle, link};
  weigh(both, contact.rows);
  const ContactAxes axes = contact.rows.axes();
  const ContactImpulses before = contact.rows.impulses;
  const bool moves = length_squared(both.a.linear) + length_squared(both.a.angular) > 0;
  const CarriedBySides<LinkResponse> carried(SurfaceEffect{contact.on_surface ? &contact.surface : nullptr}, both, axes,
                                             moves, lead);
  sweep_contact<pass, true>(contact.rows, axes, both, contact.soft, carried);
  if (!is_sound(both, contact.rows.impulses)) {
    contact.rows.impulses = before;
    return {};
  }
  link.linear = both.b.linear, link.angular = both.b.angular;
  return push_on_b(axes, contact.rows, before);
}

}  // namespace fathom
