// Stores the results of a step's sweeps from the rows of constraints.
#pragma once

#include "check/check.hpp"
#include "device/constraint_rows.hpp"
#include "device/joint_arrays.hpp"
#include "device/overload.hpp"
#include "dynamics/overlap.hpp"
#include "exec/atomic.hpp"

namespace fathom::device {

/// Stores impulses in manifolds and joints, and new offsets in contacts; marks overloaded contacts; and reports touches
/// and hits, for which it needs the bodies' velocities at the start of the step. Drops impulses that are not finite.
struct StoreImpulses {
  Bodies<> bodies;
  Contacts<contact_list, contact_manifolds, contact_events> contacts;
  Joints<joint_records, joint_impulses> joints;
  Constraints<> constraints;
  Counters* counters;
  float hit_threshold;      ///< m/s
  float dt;                 ///< s
  float overlap_kept;       ///< per step
  bool ends_with_friction;  ///< holds for every constraint, and the step
  MarkOverload mark_overload;

  FATHOM_HD void operator()(std::uint32_t k) const {
    if (counters->stopped) return;
    const ConstraintHead head = constraints.heads[k];
    if (is_joint(head.bits) && head.has(direct_extra)) return;
    if (is_joint(head.bits)) return head.bits & generic_bit ? store_generic_joint(k) : store_joint(k);
    ContactManifold& m = contacts.manifolds[constraints.manifold[k]];
    const Quad* const rows = rows_of(constraints, k);
    const Quad n = rows[impulse_row * tile_width], f = rows[(impulse_row + 1) * tile_width];
    const float sum = ((n.x + n.y) + (n.z + n.w)) + ((f.x + f.y) + (f.z + f.w));
    const bool ok = is_finite(sum);
    FATHOM_VALIDATE(n.x >= 0 && n.y >= 0 && n.z >= 0 && n.w >= 0, constraints.bodies[k].b);
    FATHOM_VALIDATE(!ok || f.w >= 0, constraints.bodies[k].b);
    m.impulses[0] = ok ? n.x : 0, m.impulses[1] = ok ? n.y : 0;
    m.impulses[2] = ok ? n.z : 0, m.impulses[3] = ok ? n.w : 0;
    m.friction_impulse[0] = ok ? f.x : 0, m.friction_impulse[1] = ok ? f.y : 0;
    m.twist_impulse = ok ? f.z : 0;
    m.step_impulse = ok ? f.w : 0;
    if (head.has(row_extra) && constraints.extras[k].roll.length > 0) store_rolling(k, m);
    // The `impulse` solver ends with the points, so friction does not yet reflect them. After a direct solution that
    // removes a load the cone holds only up to rounding.
    [[maybe_unused]] const float beyond = counters->solved_step == counters->step + 1 ? 1.25f : 1.001f;
    FATHOM_VALIDATE(!ends_with_friction || !ok || is_within_cone(m, beyond, stopping_impulse(k)),
                    constraints.bodies[k].b);
    mark_overload(k, m.step_impulse);
    if (m.step_impulse > 0 || head.has(offset_extra)) change_offset(k, head, m.step_impulse);
    look_at_touch(k, m, m.step_impulse > 0);
  }

 private:
  /// Impulse that stops any slide of the two (N·s), for checks.
  FATHOM_HD float stopping_impulse(std::uint32_t k) const {
    const PairRecord pair = constraints.bodies[k];
    const auto speed = [&](std::uint32_t i) {
      return fastest_speed(bodies.constants[i].radius, bodies.solver[i].linear.xyz(), bodies.solver[i].angular.xyz());
    };
    const float of_surfaces = constraints.heads[k].has(row_extra) ? length(constraints.extras[k].surface.slide) : 0.0f;
    return (speed(pair.a) + speed(pair.b) + of_surfaces) / bodies.constants[pair.b].inverse_mass;
  }

  FATHOM_HD void look_at_touch(std::uint32_t k, const ContactManifold& m, bool pressed) const {
    Contact& c = contacts.contacts[constraints.contact[k]];
    const bool touches = pressed || c.bits & near_bit;
    if (touches != c.in_touch()) contacts.note_touch(c, touches, *counters);
    if (!(pressed && c.bits & closing_bit) && !(c.bits & hits_bit)) return;
    const Hit hit = pressed ? hit_of(k, c, m) : Hit{};
    if (hit.speed > 0 && !(c.bits & hits_bit))
      contacts.hits[contacts.event(counters->step + 1, exec::atomic_add(counters->hits, 1u))] = {c.a, c.b, hit.point,
                                                                                                 hit.normal, hit.speed};
    c.bits = hit.is_closing ? c.bits | hits_bit : c.bits & ~hits_bit;
  }

  FATHOM_HD Hit hit_of(std::uint32_t k, const Contact& c, const ContactManifold& m) const {
    const Quad* const rows = rows_of(constraints, k);
    Quad frame[row_count];
    for (std::uint32_t r = 0; r < impulse_row; ++r) frame[r] = rows[r * tile_width];
    PointRow points[max_manifold_points];
    for (int i = 0; i < max_manifold_points; ++i)
      points[i] = point_of(frame[first_point_row + static_cast<std::uint32_t>(i)]);
    const auto body = [&](std::uint32_t i) {
      return Stepped{bodies.poses[i].position, bodies.velocities[i].linear, bodies.velocities[i].angular,
                     bodies.poses[i].rotation, bodies.solver[i].body()};
    };
    return fastest_hit(m, frame_of(frame), points, m.impulses, body(c.a), body(c.b), c.ahead(),
                       {hit_threshold, touch_distance(c.touch_halvings(), true), dt});
  }

  /// Reads few contacts: only those with an offset, and those deeper than allowed.
  FATHOM_HD void change_offset(std::uint32_t k, const ConstraintHead& head, float impulse) const {
    const Quad* const points = rows_of(constraints, k) + first_point_row * tile_width;
    const int count = static_cast<int>(head.bits & point_bits);
    float nearest = 1e30f;
    for (int i = 0; i < count; ++i) nearest = min(nearest, points[i * tile_width].z);
    Contact& c = contacts.contacts[constraints.contact[k]];
    if (!head.has(offset_extra)) {
      const float lift = mark_overload.lift(k, 0, -nearest, impulse);
      if (lift > lift_gone && !c.ahead()) c.offset = -lift;
    } else if (c.offset > 0) {
      c.offset = faded_overlap(c.offset, nearest - c.offset, overlap_kept);
    } else {
      c.offset = -mark_overload.lift(k, -c.offset, c.offset - nearest, impulse);
    }
  }

  FATHOM_HD void store_joint(std::uint32_t k) const {
    const Quad* const rows = rows_of(constraints, k);
    const Vec3 impulse = rows[joint_impulse_row * tile_width].xyz(), total = rows[joint_total_row * tile_width].xyz();
    JointRecord& joint = joints.records[constraints.contact[k] & ~joint_tag];
    const bool ok = is_finite(impulse) && is_finite(total);
    joint.impulse = ok ? impulse : Vec3{};
    joint.total = ok ? total : Vec3{};
  }

  FATHOM_HD void store_generic_joint(std::uint32_t k) const {
    const Quad* const rows = rows_of(constraints, k);
    Quad q[impulse_row + 2];
    for (std::uint32_t r = generic_written_row; r < impulse_row + 2; ++r) q[r] = rows[r * tile_width];
    const std::uint32_t slot = constraints.contact[k] & ~joint_tag;
    GenericImpulse impulse;
    if (joints.generic[slot].couples != 0) {
      CouplingRow<float> row{};
      load_coupling_impulses(q, row);
      impulse = impulse_of(row);
    } else {
      const Quad* const more = q + generic_written_row + 3;
      load_generic_impulses(q, impulse.hold, impulse.drive);
      impulse.force = {more[0].w, more[1].w, more[2].w};
      impulse.torque = more[3].xyz();
    }
    float sum = 0;
    for (int i = 0; i < axis_count; ++i) sum += impulse.hold[i] + impulse.drive[i];
    const bool ok = is_finite(sum) && is_finite(impulse.force) && is_finite(impulse.torque);
    joints.generic_impulses[slot] = ok ? impulse : GenericImpulse{};
  }

  FATHOM_HD void store_rolling(std::uint32_t k, ContactManifold& m) const {
    const Quad* const rows = rows_of(constraints, k);
    Quad frame[row_count];
    for (std::uint32_t r = 0; r < impulse_row; ++r) frame[r] = rows[r * tile_width];
    const Vec3 rolling = kept_impulse(constraints.extras[k].roll, ContactAxes(frame_of(frame)));
    m.set_rolling_impulse(is_finite(rolling) ? rolling : Vec3{});
  }
};

}  // namespace fathom::device
