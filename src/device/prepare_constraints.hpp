// The last part of build_constraints: the contact data that sweeps read.
#pragma once

#include "device/build_constraints.hpp"
#include "device/constraint_rows.hpp"
#include "device/mechanism_arrays.hpp"
#include "device/pieces.hpp"
#include "dynamics/look_ahead.hpp"
#include "dynamics/touch.hpp"
#include "exec/atomic.hpp"
#include "exec/bits.hpp"
#include "exec/kernel.hpp"

namespace fathom::device {

/// Sets the rows of every constraint from its manifold and bodies.
struct PrepareConstraints {
  static constexpr std::uint32_t group_size = constraint_group_size;
  struct Local {
    std::uint32_t points;
  };

  Bodies<> bodies;
  Contacts<contact_list> contacts;
  Joints<joint_impulses> joints;
  Mechanisms<> mechanisms;
  Constraints<constraint_heads, constraint_rows> constraints;
  Counters* counters;
  float hit_threshold;  ///< m/s
  float half_step;      ///< s, half a step
  float substeps;

  FATHOM_HD void operator()(auto group, Local& local) const {
    group.once([&] { local.points = 0; });
    group.for_each([&](std::uint32_t item) {
      const std::uint32_t k = group.index() * group_size + item;
      if (k >= counters->constraints) return;
      prepare(k);
      const std::uint32_t bits = constraints.heads[k].bits;
      if (!is_joint(bits)) exec::atomic_add(local.points, bits & point_bits);
    });
    group.once([&] { exec::atomic_add(counters->points, local.points); });
  }

 private:
  /// Sets flags for `StoreImpulses`. Written only if they change.
  FATHOM_HD static void look_at_touch(Contact& c, float nearest, bool is_closing) {
    const bool is_near = nearest <= touch_distance(c.touch_halvings(), c.in_touch());
    const std::uint32_t bits = (c.bits & ~static_cast<std::uint32_t>(near_bit | closing_bit)) |
                               (is_near ? 1u * near_bit : 0u) | (is_closing ? 1u * closing_bit : 0u);
    if (bits != c.bits) c.bits = bits;
  }

  FATHOM_HD void prepare(std::uint32_t k) const {
    const PairRecord pair = constraints.bodies[k];
    const SolverBody a = bodies.solver[pair.a].body(), b = bodies.solver[pair.b].body();
    const std::uint32_t number = constraints.contact[k];
    if (number & joint_tag)
      return prepare_joint(k, joints.records[number & ~joint_tag], a, b,
                           is_anisotropic(a) || is_anisotropic(b) ? 1u * anisotropic_bit : 0u);
    if (is_anisotropic(a) || is_anisotropic(b))
      prepare<SymMat3>(k, pair, a, b, anisotropic_bit);
    else
      prepare<float>(k, pair, a, b, 0);
  }

  template <class Inertia>
  FATHOM_HD void prepare(std::uint32_t k, PairRecord pair, const SolverBody& solver_a, const SolverBody& solver_b,
                         std::uint32_t bits) const {
    const ContactManifold& m = contacts.manifolds[constraints.manifold[k]];
    const ContactBodies<Inertia> both{contact_body<Inertia>(bodies, pair.a, solver_a),
                                      contact_body<Inertia>(bodies, pair.b, solver_b)};
    ContactRows made;
    Contact& contact = contacts.contacts[constraints.contact[k]];
    const float offset = contact.offset;
    Pose pose_a = bodies.poses[pair.a], pose_b = bodies.poses[pair.b];
    const float time = contact.ahead() ? m.step_impulse : 0;
    if (contact.ahead()) {
      pose_a = advanced(pose_a, {both.a.linear, 0, both.a.angular, 0}, time);
      pose_b = advanced(pose_b, {both.b.linear, 0, both.b.angular, 0}, time);
    }
    const ContactOccasion occasion{offset, contact.round(), contact.ahead() ? 0 : half_step, substeps};
    float nearest = offset + prepare_contact(m, pose_a, pose_b, occasion, both, made);
    if (contact.ahead()) nearest = count_back(time, both, made);
    const ContactAxes axes = made.axes();
    look_at_touch(contact, nearest, approaches(axes.velocity(both), made.points, made.count, hit_threshold));
    const bool rolls = contact.round() && m.rolling_length() > 0;
    const bool is_special = rolls || contact.on_moving_surface() || contact.by_direction();
    if (is_special) {
      ContactExtras extras{rolls ? roll_row(m, axes) : RollRow{},
                           {surface_slide(bodies, contacts, constraints.contact[k])}};
      if (contact.by_direction()) {
        const FrictionEllipse ellipse = friction_ellipse(bodies, contact, axes.n);
        made.frame.friction.coefficient = ellipse.coefficient;
        extras.surface.set_grain(ellipse, axes);
      }
      constraints.extras[k] = extras;
    }
    const bool is_linked = mechanisms.solves(k, pair.a, pair.b, counters->mechanism_links);
    if (is_linked) {
      const float fall = 2 * half_step * length(counters->gravity);
      even_out(made, m.step_impulse * (both.a.inverse_mass + both.b.inverse_mass) / fall);
    }
    Quad* const rows = rows_of(constraints, k);
    store_frame(rows, made.frame);
    for (int i = 0; i < max_manifold_points; ++i)
      if (made.has(i)) store_point(rows, i, made.points[i]);
    store_normal_impulses(rows, made.impulses);
    store_friction_impulses(rows, made.impulses);
    rows[mass_row * tile_width] = {both.a.inverse_mass, solver_a.inverse_inertia, both.b.inverse_mass,
                                   solver_b.inverse_inertia};
    if (m.restitution > 0) {
      bits |= bounces_bit;
      const Vec3 still;
      BounceRow row{m.restitution, 0};
      row.pull = dot(axes.n, (both.b.inverse_mass > 0 ? bodies.motion[pair.b].acceleration : still) -
                                 (both.a.inverse_mass > 0 ? bodies.motion[pair.a].acceleration : still));
      constraints.bounces[k] = row;
    }
    if (contact.fixed_a()) bits |= pushes_fixed_bit;
    bits |= ranks_of(pair, contact.colour());
    const std::uint32_t extras = (offset != 0 ? 1u * offset_extra : 0u) | (is_special ? 1u * row_extra : 0u);
    ConstraintHead& head = constraints.heads[k];
    head = {pair.a, pair.b, static_cast<std::uint32_t>(made.count) | bits, extras};
    if (is_linked)
      head.set_held(1);
    else
      head.held_and_extras |= hold_extras(pair, contact, m, both);
  }

  /// `inertia_extra` and `jointed_bits`. Bodies with joints keep the whole push-out velocity: torn joints press them
  /// into others (dynamics/torn_joint.hpp).
  template <class Inertia>
  FATHOM_HD std::uint32_t hold_extras(PairRecord pair, const Contact& contact, const ContactManifold& m,
                                      const ContactBodies<Inertia>& both) const {
    const bool fixed_a = contact.fixed_a();
    const bool has_joints =
        counters->joints > 0 && ((fixed_a ? 0 : bodies.joint_colours[pair.a]) | bodies.joint_colours[pair.b]) != 0;
    const float scale_a = fixed_a ? 1.0f : inertia_scale(bodies, *counters, pair.a);
    const bool is_scaled = max(scale_a, inertia_scale(bodies, *counters, pair.b)) > 1;
    if (!has_joints) return is_scaled ? 1u * inertia_extra : 0u;
    if (is_scaled || contact.ahead()) return 0;
    const float part = jointed_part(m.step_impulse, both.a.inverse_mass + both.b.inverse_mass,
                                    2 * half_step * length(counters->gravity));
    return static_cast<std::uint32_t>(fma(part, static_cast<float>(jointed_steps), 0.5f)) << jointed_shift;
  }

  FATHOM_HD void prepare_joint(std::uint32_t k, const JointRecord& joint, const SolverBody& a, const SolverBody& b,
                               std::uint32_t bits) const {
    if (joint.fixed_a) bits |= pushes_fixed_bit;
    if (joint.is_generic) bits |= generic_bit;
    bits |= point_bits | ranks_of({joint.a, joint.b}, joint.colour);
    const bool is_direct = mechanisms.is_direct(constraints.contact[k] & ~joint_tag);
    constraints.heads[k] = {joint.a, joint.b, bits, is_direct ? 1u * direct_extra : 0u};
    if (!is_direct) prepare_joint_rows(k, joint, a, b);
  }

  FATHOM_HD void prepare_joint_rows(std::uint32_t k, const JointRecord& joint, const SolverBody& a,
                                    const SolverBody& b) const {
    const Pose &pose_a = bodies.poses[joint.a], &pose_b = bodies.poses[joint.b];
    const auto unit = [](Quat q) { return UnitQuat<float>{q.w, q.vector()}; };
    const UnitQuat<float> q_a = unit(pose_a.rotation), q_b = unit(pose_b.rotation);
    const Vec3 between = pose_b.position - pose_a.position;
    Quad* const rows = rows_of(constraints, k);
    if (joint.is_generic) {
      const std::uint32_t slot = constraints.contact[k] & ~joint_tag;
      const GenericJoint& generic = joints.generic[slot];
      if (generic.couples != 0)
        store_coupling(
            rows, joints.reactions[slot],
            prepared_coupling(generic, joint.anchor_a, joint.anchor_b, pose_a, pose_b, joints.generic_impulses[slot]));
      else
        prepare_generic_rows(rows, joint, slot, {q_a, q_b, between}, a, b);
    } else {
      BallJointRow<float> row;
      prepare_ball_joint(q_a, q_b, between, joint.anchor_a, joint.anchor_b,
                         start_share(length_squared(joint.impulse), joint.max_start) * joint.impulse, row);
      row.bias_rate = joint.bias_rate, row.mass_scale = joint.mass_scale, row.impulse_scale = joint.impulse_scale;
      row.rigid = one_where_zero(joint.max_impulse), row.most = joint.max_impulse;
      row.compliance = joint.compliance;
      store_joint(rows, row);
      store_joint_impulse(rows, row);
      store_joint_total(rows, row);
    }
    rows[mass_row * tile_width] = {a.inverse_mass, a.inverse_inertia, b.inverse_mass, b.inverse_inertia};
  }

  /// Placement of a joint's bodies: their orientations, and the vector from A's centre to B's (m).
  struct Placement {
    UnitQuat<float> q_a, q_b;
    Vec3 between;
  };
  FATHOM_HD void prepare_generic_rows(Quad* rows, const JointRecord& joint, std::uint32_t slot, const Placement& at,
                                      const SolverBody& a, const SolverBody& b) const {
    const GenericJoint& generic = joints.generic[slot];
    const GenericImpulse impulse = started(joints.generic_impulses[slot], joint.max_start);
    GenericJointRow<float> row;
    prepare_generic_joint(at.q_a, at.q_b, at.between, generic.on_a, generic.on_b, joint.anchor_a, joint.anchor_b, row);
    row.bias_rate = joint.bias_rate, row.mass_scale = joint.mass_scale, row.impulse_scale = joint.impulse_scale;
    for (int i = 0; i < axis_count; ++i) row.hold[i] = impulse.hold[i], row.drive[i] = impulse.drive[i];
    if (generic.reacts != 0) begin_rates(row, generic, a, b);
    store_reactions(joints.reactions[slot], row, generic.use());
    store_generic_start(rows, row);
    store_generic_impulses(rows, row);
  }

  FATHOM_HD std::uint32_t ranks_of(PairRecord pair, std::uint32_t colour) const {
    const std::uint64_t before = (std::uint64_t{1} << colour % further_colour) - 1;
    const std::uint64_t colours_a = bodies.colours[pair.a], colours_b = bodies.colours[pair.b];
    return exec::bit_count(colours_a & before) << rank_a_shift | exec::bit_count(colours_b & before) << rank_b_shift |
           exec::bit_count(colours_a) << count_a_shift | exec::bit_count(colours_b) << count_b_shift;
  }
};

}  // namespace fathom::device
