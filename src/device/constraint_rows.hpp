// Layout of constraints and bodies in the solver's memory: rows of quads, and the meaning of their bits.
#pragma once

#include <cstdint>
#include <type_traits>

#include "device/contact_arrays.hpp"
#include "device/joint_arrays.hpp"
#include "device/pieces.hpp"
#include "dynamics/generic_joint.hpp"

namespace fathom::device {

/// `ConstraintHead::bits`: the number of points in the low bits, all of which are set for a joint, and
enum ConstraintBits : std::uint32_t {
  point_bits = 7,
  bounces_bit = 8,
  generic_bit = bounces_bit,  ///< for a joint
  anisotropic_bit = 16,
  pushes_fixed_bit = 32,  ///< A cannot be pushed
  // For each body: rank of this contact, and number, among its contacts with a colour.
  rank_a_shift = 6,
  rank_b_shift = 12,
  rank_bits = 63,
  count_a_shift = 18,
  count_b_shift = 25,
  count_bits = 127,
};

FATHOM_HD bool is_joint(std::uint32_t bits) { return (bits & point_bits) == point_bits; }

/// Velocity of the surface of piece i relative to its body (m/s, world axes).
template <BodyPart... written>
FATHOM_HD Vec3 surface_velocity(const Bodies<written...>& bodies, std::uint32_t i) {
  if (!bodies.constants[i].has_moving_surface()) return {};
  return rotate(bodies.poses[i].rotation, bodies.traits[i].velocity);
}
/// Contribution of the surfaces in contact k to the sliding velocity of B against A (m/s, world axes).
template <BodyPart... written, ContactPart... of_contacts>
FATHOM_HD Vec3 surface_slide(const Bodies<written...>& bodies, const Contacts<of_contacts...>& contacts,
                             std::uint32_t k) {
  const Contact& c = contacts.contacts[k];
  if (c.bits & own_slide_bit) return contacts.own_slides[k];
  const auto [a, b] = pieces_of(bodies, c);
  const Material* const own = own_material(bodies, c);
  return surface_velocity(bodies, b) -
         (own ? rotate(bodies.poses[a].rotation, own->surface_velocity) : surface_velocity(bodies, a));
}

/// Friction of piece i with an axis of its own.
template <BodyPart... written>
FATHOM_HD SideFriction friction_of(const Bodies<written...>& bodies, std::uint32_t i) {
  const BodyConstants& c = bodies.constants[i];
  const SurfaceTraits traits = c.has_friction_axis() ? bodies.traits[i] : SurfaceTraits{};
  return side_friction(c.friction, traits.friction_along, c.friction_rule(), traits.friction_axis,
                       bodies.poses[i].rotation);
}
FATHOM_HD SideFriction friction_of(const Material& m, Quat rotation) {
  return side_friction(m.friction, m.friction_along, m.friction_rule, m.friction_axis, rotation);
}
/// The friction of a contact `by_direction` with this normal (world axes).
template <BodyPart... written>
FATHOM_HD FrictionEllipse friction_ellipse(const Bodies<written...>& bodies, const Contact& c, Vec3 normal) {
  const auto [a, b] = pieces_of(bodies, c);
  const Material* const own = own_material(bodies, c);
  return friction_ellipse(own ? friction_of(*own, bodies.poses[a].rotation) : friction_of(bodies, a),
                          friction_of(bodies, b), normal);
}

/// Start of the rows of constraint k; row r is 32·r quads further.
template <ConstraintPart... written>
FATHOM_HD auto rows_of(const Constraints<written...>& c, std::uint32_t k) {
  return c.rows + (static_cast<std::size_t>(k / tile_width) * (row_count * tile_width) + k % tile_width);
}

FATHOM_HD void store_frame(Quad* rows, const ContactFrame& f) {
  const ContactResponse<float>& k = f.response;
  const ContactFriction<float>& m = f.friction;
  rows[0] = {f.normal.x, f.normal.y, f.normal.z, f.tangent.x};
  rows[1 * tile_width] = {f.tangent.y, f.tangent.z, f.arm_a.x, f.arm_a.y};
  rows[2 * tile_width] = {f.arm_a.z, f.arm_b.x, f.arm_b.y, f.arm_b.z};
  rows[3 * tile_width] = {k.nn, k.n1, k.n2, k.k11};
  rows[4 * tile_width] = {k.k12, k.k22, m.coefficient, m.patch_radius};
  rows[5 * tile_width] = {m.slide_11, m.slide_12, m.slide_22, m.twist_mass};
}

FATHOM_HD ContactFrame frame_of(const Quad* q) {
  ContactFrame f;
  f.normal = {q[0].x, q[0].y, q[0].z};
  f.tangent = {q[0].w, q[1].x, q[1].y};
  f.arm_a = {q[1].z, q[1].w, q[2].x};
  f.arm_b = {q[2].y, q[2].z, q[2].w};
  f.response = {q[3].x, q[3].y, q[3].z, q[3].w, q[4].x, q[4].y};
  f.friction = {q[4].z, q[4].w, q[5].x, q[5].y, q[5].z, q[5].w};
  return f;
}

FATHOM_HD PointRow point_of(const Quad& q) { return {q.x, q.y, q.z, q.w}; }
FATHOM_HD void store_point(Quad* rows, int i, const PointRow& p) {
  rows[(first_point_row + static_cast<std::uint32_t>(i)) * tile_width] = {p.x, p.y, p.separation, p.mass};
}
FATHOM_HD void store_normal_impulses(Quad* rows, const ContactImpulses& p) {
  rows[impulse_row * tile_width] = {p.normal[0], p.normal[1], p.normal[2], p.normal[3]};
}
FATHOM_HD void store_friction_impulses(Quad* rows, const ContactImpulses& p) {
  rows[(impulse_row + 1) * tile_width] = {p.slide_1, p.slide_2, p.twist, p.step};
}

FATHOM_HD ContactImpulses impulses_of(const Quad* rows) {
  const Quad n = rows[impulse_row], f = rows[impulse_row + 1];
  ContactImpulses p;
  p.normal[0] = n.x, p.normal[1] = n.y, p.normal[2] = n.z, p.normal[3] = n.w;
  p.slide_1 = f.x, p.slide_2 = f.y, p.twist = f.z, p.step = f.w;
  return p;
}

/// Loads all rows of a contact with `count` points from `q`, one quad per row, except those for bouncing.
FATHOM_HD void load_contact(const Quad* q, int count, ContactRows& rows) {
  rows.frame = frame_of(q);
  for (int i = 0; i < max_manifold_points; ++i)
    rows.points[i] = point_of(q[first_point_row + static_cast<std::uint32_t>(i)]);
  rows.impulses = impulses_of(q);
  rows.count = count;
}

// Sweeps read four rows of a joint and write four.

FATHOM_HD void store_joint(Quad* rows, const BallJointRow<float>& r) {
  rows[0] = quad(r.arm_a, r.bias_rate);
  rows[1 * tile_width] = quad(r.arm_b, r.mass_scale);
  rows[2 * tile_width] = quad(r.gap, r.impulse_scale);
  rows[3 * tile_width] = {r.rigid, r.most, r.compliance, 0};
}
FATHOM_HD void store_joint_impulse(Quad* rows, const BallJointRow<float>& r) {
  rows[joint_moment_row * tile_width] = quad(r.moment_a, 0);
  rows[(joint_moment_row + 1) * tile_width] = quad(r.moment_b, 0);
  rows[joint_impulse_row * tile_width] = quad(r.impulse, 0);
}
FATHOM_HD void store_joint_total(Quad* rows, const BallJointRow<float>& r) {
  rows[joint_total_row * tile_width] = quad(r.total, 0);
}
FATHOM_HD BallJointRow<float> joint_of(const Quad* q) {
  BallJointRow<float> r;
  r.arm_a = q[0].xyz(), r.bias_rate = q[0].w;
  r.arm_b = q[1].xyz(), r.mass_scale = q[1].w;
  r.gap = q[2].xyz(), r.impulse_scale = q[2].w;
  r.rigid = q[3].x, r.most = q[3].y, r.compliance = q[3].z;
  r.moment_a = q[joint_moment_row].xyz(), r.moment_b = q[joint_moment_row + 1].xyz();
  r.impulse = q[joint_impulse_row].xyz();
  r.total = q[joint_total_row].xyz();
  r.pull = {};
  return r;
}

// Sweeps read all rows of a generic joint, and its definition.

FATHOM_HD void store_generic_start(Quad* rows, const GenericJointRow<float>& r) {
  rows[0] = quad(r.frame_a.v, r.frame_a.w);
  rows[1 * tile_width] = quad(r.frame_b.v, r.frame_b.w);
  rows[2 * tile_width] = quad(r.arm_a, r.bias_rate);
  rows[3 * tile_width] = quad(r.arm_b, r.mass_scale);
  rows[4 * tile_width] = quad(r.gap, r.impulse_scale);
}
FATHOM_HD void store_generic_impulses(Quad* rows, const GenericJointRow<float>& r) {
  Quad* const to = rows + generic_written_row * tile_width;
  to[0] = {r.hold[0], r.hold[1], r.hold[2], r.hold[3]};
  to[1 * tile_width] = {r.hold[4], r.hold[5], r.drive[0], r.drive[1]};
  to[2 * tile_width] = {r.drive[2], r.drive[3], r.drive[4], r.drive[5]};
  to[3 * tile_width] = quad(r.given, r.force.x);
  to[4 * tile_width] = quad(r.moment_a, r.force.y);
  to[5 * tile_width] = quad(r.moment_b, r.force.z);
  to[6 * tile_width] = quad(r.torque, 0);
}
/// From `q`, one quad per row.
FATHOM_HD void load_generic_impulses(const Quad* q, float (&hold)[axis_count], float (&drive)[axis_count]) {
  q += generic_written_row;
  hold[0] = q[0].x, hold[1] = q[0].y, hold[2] = q[0].z, hold[3] = q[0].w, hold[4] = q[1].x, hold[5] = q[1].y;
  drive[0] = q[1].z, drive[1] = q[1].w, drive[2] = q[2].x, drive[3] = q[2].y, drive[4] = q[2].z, drive[5] = q[2].w;
}
FATHOM_HD GenericJointRow<float> generic_joint_of(const Quad* q, const GenericJoint& joint) {
  GenericJointRow<float> r;
  r.frame_a = {q[0].w, q[0].xyz()}, r.frame_b = {q[1].w, q[1].xyz()};
  r.arm_a = q[2].xyz(), r.bias_rate = q[2].w;
  r.arm_b = q[3].xyz(), r.mass_scale = q[3].w;
  r.gap = q[4].xyz(), r.impulse_scale = q[4].w;
  r.pull = {};
  r.distance = joint.distance, r.cone = joint.cone, r.is_soft = joint.is_soft;
  for (int i = 0; i < axis_count; ++i) r.axes[i] = joint.axes[i];
  load_generic_impulses(q, r.hold, r.drive);
  const Quad* const more = q + generic_written_row + 3;
  r.given = more[0].xyz(), r.moment_a = more[1].xyz(), r.moment_b = more[2].xyz();
  r.force = {more[0].w, more[1].w, more[2].w};
  r.torque = more[3].xyz();
  return r;
}

FATHOM_HD void store_reactions(JointReactions& to, const GenericJointRow<float>& r, JointUse use) {
  if (use.moves) to.pulled = r.pulled, to.pulled_a = r.pulled_a, to.pulled_b = r.pulled_b;
  for (int i = 0; use.reacts && i < axis_count; ++i) to.bounce[i] = r.bounce[i], to.rate[i] = r.rate[i];
}
FATHOM_HD void load_reactions(const JointReactions& from, float min_hit, JointUse use, GenericJointRow<float>& r) {
  if (use.moves) r.pulled = from.pulled, r.pulled_a = from.pulled_a, r.pulled_b = from.pulled_b;
  r.min_hit = min_hit;
  for (int i = 0; use.reacts && i < axis_count; ++i) r.bounce[i] = from.bounce[i], r.rate[i] = from.rate[i];
}

// The same for a coupling.

FATHOM_HD void store_coupling_impulses(Quad* rows, const CouplingRow<float>& r) {
  Quad* const to = rows + generic_written_row * tile_width;
  to[0] = {r.impulse, r.angle_a.turns, r.angle_a.angle, r.angle_b.turns};
  to[1 * tile_width] = quad(r.given_a, r.angle_b.angle);
  to[2 * tile_width] = quad(r.given_b, r.force.x);
  to[3 * tile_width] = quad(r.moment_a, r.force.y);
  to[4 * tile_width] = quad(r.moment_b, r.force.z);
  to[5 * tile_width] = quad(r.torque, 0);
  to[6 * tile_width] = quad(r.way_b, 0);
}
FATHOM_HD void store_coupling(Quad* rows, JointReactions& reactions, const CouplingRow<float>& r) {
  rows[0] = quad(r.frame_a.v, r.frame_a.w);
  rows[1 * tile_width] = quad(r.frame_b.v, r.frame_b.w);
  rows[2 * tile_width] = quad(r.arm_a, 0);
  rows[3 * tile_width] = quad(r.arm_b, 0);
  rows[4 * tile_width] = quad(r.way_a, 0);
  reactions.rate[0] = r.start_a.turns, reactions.rate[1] = r.start_a.angle;
  reactions.rate[2] = r.start_b.turns, reactions.rate[3] = r.start_b.angle;
  store_coupling_impulses(rows, r);
}
/// Results of sweeps, from `q`, one quad per row.
FATHOM_HD void load_coupling_impulses(const Quad* q, CouplingRow<float>& r) {
  q += generic_written_row;
  r.impulse = q[0].x, r.angle_a = {q[0].y, q[0].z}, r.angle_b = {q[0].w, q[1].w};
  r.given_a = q[1].xyz(), r.given_b = q[2].xyz(), r.moment_a = q[3].xyz(), r.moment_b = q[4].xyz();
  r.force = {q[2].w, q[3].w, q[4].w}, r.torque = q[5].xyz(), r.way_b = q[6].xyz();
}
FATHOM_HD CouplingRow<float> coupling_of(const Quad* q, const GenericJoint& joint, const JointReactions& reactions) {
  CouplingRow<float> r;
  r.frame_a = {q[0].w, q[0].xyz()}, r.frame_b = {q[1].w, q[1].xyz()};
  r.arm_a = q[2].xyz(), r.arm_b = q[3].xyz(), r.way_a = q[4].xyz();
  r.start_a = {reactions.rate[0], reactions.rate[1]}, r.start_b = {reactions.rate[2], reactions.rate[3]};
  define_coupling(joint, r);
  load_coupling_impulses(q, r);
  return r;
}

template <class Inertia, BodyPart... written>
FATHOM_HD Inertia world_inertia(const Bodies<written...>& bodies, std::uint32_t i, float inverse_mass,
                                float inverse_inertia) {
  return fathom::world_inertia<Inertia>(bodies.inertia, i, inverse_mass, inverse_inertia);
}

template <class Inertia, BodyPart... written>
FATHOM_HD ContactBody<Inertia> contact_body(const Bodies<written...>& bodies, std::uint32_t i, const SolverBody& body) {
  return {body.linear, body.angular, body.inverse_mass,
          world_inertia<Inertia>(bodies, i, body.inverse_mass, body.inverse_inertia)};
}

/// Number of times the solver wrote a quad of SolverQuads.
FATHOM_HD std::uint32_t writes_of(const Quad& q) { return __builtin_bit_cast(std::uint32_t, q.w); }
FATHOM_HD Quad written(Vec3 v, std::uint32_t writes) { return quad(v, __builtin_bit_cast(float, writes)); }

}  // namespace fathom::device
