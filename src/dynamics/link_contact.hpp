// Contacts of a mechanism's links that the mechanism solves itself (dynamics/mechanism.hpp): those with obstacles, and
// with free bodies, which no joint holds. Pure, for host and device.
//
// A sweep over a contact knows the inertia of its own two bodies. A wheel of 1 kg that carries a tonne through its
// hinge then stops a thousandth of that tonne per sweep, and as soon as the joints are solved it moves again: the car
// hops. A finger that a strong motor presses on a body sinks into it, because each sweep adds no more than the finger's
// own momentum to what the contact gives. So where a link carries much more than its own weight, or touches a free
// body, its contacts are swept once more after the joints, with the response of the whole mechanism in place of the
// link's own inverse inertia. (Robotics knows it as the inverse of the operational space inertia: Khatib, "A unified
// approach for motion and force control of robot manipulators", IEEE J. Robotics and Automation 3(1), 1987; recursively
// along a tree in Kreutz-Delgado, Jain, Rodriguez, "Recursive formulation of operational space control", Int. J.
// Robotics Research 11(4), 1992.)
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

/// Whether a link's contact with an obstacle is one that its mechanism solves: by the load that its `impulse` (N·s) of
/// the last step shows, in the link's own weight. In a step a fall gains `fall` (m/s). What is welded to a link may
/// press it down hardly at all and yet lean over by far: a lamp post.
FATHOM_HD bool is_for_mechanism(const MechanismLink& link, float impulse, float inverse_mass, float fall) {
  return impulse * inverse_mass > (link.is_welded ? 0.0f : jointed_load * fall);
}
/// The same for a contact with a free body, by the sum of both inverse masses (1/kg): two fingers may hold a body with
/// half of its weight each.
FATHOM_HD bool is_for_mechanism(float impulse, float inverse_sum, float fall) {
  return impulse * inverse_sum > gripping_load * fall;
}

/// Response of a body that no joint holds.
FATHOM_HD LinkResponse free_response(float inverse_mass, const SymMat3& inverse_inertia) {
  return {{inverse_mass, inverse_mass, inverse_mass, 0, 0, 0}, {}, {}, {}, inverse_inertia};
}

/// Whether a contact that a mechanism solves may still add inertia to a free body (dynamics/overload.hpp): if it
/// carries weight, of which the body's other contacts know nothing. A body that is gripped from its sides must keep its
/// momentum.
FATHOM_HD bool carries_weight(Vec3 normal, Vec3 up) { return abs(dot(normal, up)) > 0.5f; }

/// Effective masses of a contact between the responses of both its bodies.
struct LinkContactMasses {
  ContactResponse<float> response;
  float points[max_manifold_points];
  float slide_11, slide_12, slide_22, twist;

  FATHOM_HD static LinkContactMasses of(const ContactRows& rows) {
    const ContactFriction<float>& f = rows.frame.friction;
    return {rows.frame.response, {rows.points[0].mass, rows.points[1].mass, rows.points[2].mass, rows.points[3].mass},
            f.slide_11,          f.slide_12,
            f.slide_22,          f.twist_mass};
  }
  FATHOM_HD void put_into(ContactRows& rows) const {
    rows.frame.response = response;
    for (int i = 0; i < max_manifold_points; ++i) rows.points[i].mass = points[i];
    ContactFriction<float>& f = rows.frame.friction;
    f.slide_11 = slide_11, f.slide_12 = slide_12, f.slide_22 = slide_22, f.twist_mass = twist;
  }
};

/// A contact of a link with an obstacle or a free body.
struct LinkContact {
  ContactRows rows;  ///< along arms of the step's beginning; see `weigh_link_contact`
  ContactStep soft;
  ContactBody<LinkResponse> other;
  ContactSurface surface;
  bool link_is_a = false;    ///< else the link is B; with an obstacle it is
  bool is_pushable = false;  ///< the other one
  bool on_surface = false;

  /// Moves an obstacle by a substep of length h (s), like the bodies.
  FATHOM_HD void move_obstacle(float h) {
    other.moved = mul_add(other.moved, h, other.linear);
    other.turned = mul_add(other.turned, h, other.angular);
  }
};

/// Parameters of a soft sweep over a link's contact: with the response of the whole mechanism nothing has to yield, and
/// a contact that gave back part of its impulse would let a motor press no harder than its link moves in a substep.
FATHOM_HD ContactStep link_contact_step(float h, float push_out_velocity) {
  return {1 / h, support_push_out_rate, 1, 0, push_out_velocity, 0};
}

/// A contact's impulse over the step so far, `step` (N·s), after the mechanism has changed the sum of its points from
/// `before`, which the substep's last sweep has counted, to `now`. Rounding must not leave less than nothing.
FATHOM_HD float step_impulse_with(float step, float before, float now) { return max(step + (now - before), 0.0f); }

/// What a change of a contact's impulses gives to B; `arm` (m) leads to c from the point about which its moment is. A
/// gets the opposite.
FATHOM_HD Wrench push_on_b(const ContactAxes& axes, const ContactRows& rows, const ContactImpulses& before, Vec3 arm) {
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
  return {force, torque + cross(arm, force)};
}

/// Moves a share of the points' impulses, with which the step begins, towards an even distribution; sweeps give back
/// what a moment needs. Two contacts that grip a body from both sides could otherwise press on one edge of it without
/// end, and friction, which acts where they press, would turn the body. Points that neither press nor touch stay
/// without. `load`: in weights of the bodies' effective mass. A strong grip has friction to spare, and a share of its
/// impulses would shake a light finger.
FATHOM_HD void even_out(ContactRows& rows, float load) {
  const float share = evened_share * evened_load / max(load, evened_load);
  const float slop = support_slop(rows.frame.friction.patch_radius);
  bool touches[max_manifold_points];
  float sum = 0, count = 0;
  for (int i = 0; i < rows.count; ++i) {
    touches[i] = rows.impulses.normal[i] > 0 || rows.points[i].separation <= slop;
    if (touches[i]) sum += rows.impulses.normal[i], ++count;
  }
  for (int i = 0; i < rows.count; ++i)
    if (touches[i])
      rows.impulses.normal[i] = fma(share, sum / count - rows.impulses.normal[i], rows.impulses.normal[i]);
}

/// The sides of a link's contact; `link` may be A only beside a body that can be pushed.
template <bool is_pushable>
FATHOM_HD ContactBodies<LinkResponse> sides_of(const LinkContact& contact, const ContactBody<LinkResponse>& link) {
  const bool is_a = is_pushable && contact.link_is_a;
  ContactBodies<LinkResponse> sides{is_a ? link : contact.other, is_a ? contact.other : link};
  if constexpr (!is_pushable) sides.a.inverse_mass = 0, sides.a.inverse_inertia = {};
  return sides;
}

/// Sets the effective masses to those between the responses of both bodies. Before the sweeps of a solution: all
/// contacts of a mechanism at once, while a sweep comes to one after the other.
template <bool is_pushable>
FATHOM_HD void weigh_link_contact(LinkContact& contact, const ContactBody<LinkResponse>& link) {
  weigh(sides_of<is_pushable>(contact, link), contact.rows);
}

/// One sweep over a link's contact; `link` is at its current velocity and gets the impulses, as does the other body if
/// it can be pushed. Returns what they give to the link, about its centre; nothing where they are not finite. `lead`:
/// see `friction_lead`. A case of its own for obstacles, which are frequent: they lack the other body's response, half
/// of the registers.
template <ContactPass pass, bool is_pushable>
FATHOM_HD Wrench sweep_link_contact(LinkContact& contact, ContactBody<LinkResponse>& link, float lead) {
  const bool is_a = is_pushable && contact.link_is_a;
  ContactBodies<LinkResponse> both = sides_of<is_pushable>(contact, link);
  const ContactAxes axes = contact.rows.axes();
  const ContactImpulses before = contact.rows.impulses;
  const bool moves = !is_pushable && length_squared(both.a.linear) + length_squared(both.a.angular) > 0;
  const CarriedBySides<LinkResponse> carried(SurfaceEffect{contact.on_surface ? &contact.surface : nullptr}, both, axes,
                                             moves, lead);
  sweep_contact<pass, true>(contact.rows, axes, both, contact.soft, carried);
  if (!is_sound(both, contact.rows.impulses)) {
    contact.rows.impulses = before;
    return {};
  }
  const ContactBody<LinkResponse>&now = is_a ? both.a : both.b, &other = is_a ? both.b : both.a;
  link.linear = now.linear, link.angular = now.angular;
  if constexpr (is_pushable) contact.other.linear = other.linear, contact.other.angular = other.angular;
  const Wrench push = push_on_b(axes, contact.rows, before, is_a ? axes.arm_a : axes.arm_b);
  return is_a ? -push : push;
}

}  // namespace fathom
