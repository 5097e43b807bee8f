// Operations of steps on mechanisms, other than solving (device/solve_directly.hpp).
#pragma once

#include "check/check.hpp"
#include "device/constraint_rows.hpp"
#include "device/contact_arrays.hpp"
#include "device/mechanism_arrays.hpp"
#include "dynamics/torn_joint.hpp"
#include "exec/atomic.hpp"

namespace fathom::device {

/// The bodies of a joint, and its anchors in body axes (m).
struct JointEnds {
  std::uint32_t a, b;
  Vec3 anchor_a, anchor_b;

  FATHOM_HD explicit JointEnds(const JointRecord& j) : a(j.a), b(j.b), anchor_a(j.anchor_a), anchor_b(j.anchor_b) {}
};

/// Bodies and joints with the interface that MechanismSolver expects, from sets that allow the writes it does.
template <class BodySet, class JointSet>
struct LinkedBodies {
  const BodySet* bodies;
  const JointSet* joints;
  const Mechanisms<mechanism_states>* mechanisms;
  float push_out;  ///< m/s
  SpeedLimits speed_limits;

  FATHOM_HD LinkState& state(std::uint32_t i) const { return mechanisms->states[i]; }
  FATHOM_HD JointLink& generic(std::uint32_t number) const { return mechanisms->generic[number]; }
  FATHOM_HD SolverBody body(std::uint32_t /*i*/, const MechanismLink& link) const { return solver_body(link.body); }
  FATHOM_HD SolverBody solver_body(std::uint32_t i) const { return bodies->solver[i].body(); }
  FATHOM_HD void set_velocity(std::uint32_t /*i*/, const MechanismLink& link, Vec3 linear, Vec3 angular) const {
    SolverQuads& to = bodies->solver[link.body];
    to.linear = quad(linear, to.linear.w), to.angular = quad(angular, to.angular.w);
  }
  FATHOM_HD void add_velocity(std::uint32_t i, const MechanismLink& link, Vec3 linear, Vec3 angular) const {
    const SolverQuads& from = bodies->solver[link.body];
    set_velocity(i, link, from.linear.xyz() + linear, from.angular.xyz() + angular);
  }
  FATHOM_HD bool is_isotropic(std::uint32_t i) const { return bodies->constants[i].is_isotropic(); }
  FATHOM_HD float inverse_mass(std::uint32_t i) const { return bodies->constants[i].inverse_mass; }
  FATHOM_HD const SymMat3& inertia(std::uint32_t i) const { return bodies->tensors[i].inertia; }
  FATHOM_HD const Pose& pose(std::uint32_t i) const { return bodies->poses[i]; }
  FATHOM_HD SymMat3 response(std::uint32_t /*i*/, const MechanismLink& link) const {
    const SolverBody body = solver_body(link.body);
    return world_inertia<SymMat3>(*bodies, link.body, body.inverse_mass, body.inverse_inertia);
  }
  FATHOM_HD Vec3 swing(const MechanismLink& link) const {
    return mechanisms->records[link.mechanism].swings() ? bodies->motion[link.body].acceleration : Vec3{};
  }
  /// A body that swings moves by the mean of its velocities before and after gravity's acceleration. It has already
  /// moved by the latter, unless nothing acted on it (`SolveConstraints::integrate_position`).
  FATHOM_HD void move_by_mean(const MechanismLink& link, float h) const {
    if (link.is_copy()) return;
    SolverQuads& body = bodies->solver[link.body];
    const WarmStart w = bodies->warm[link.body];
    if (!mechanisms->records[link.mechanism].swings() ||
        (body.linear.xyz() == w.linear_reference && w.linear == Vec3{}))
      return;
    const Vec3 moved = mul_add(body.moved.xyz(), h, mean_velocity(Vec3{}, bodies->motion[link.body].acceleration, h));
    body.moved = quad(moved, body.moved.w);
  }
  FATHOM_HD JointEnds joint(std::uint32_t slot) const { return JointEnds(joints->records[slot]); }
  FATHOM_HD Vec3 last_impulse(std::uint32_t slot) const { return joints->records[slot].impulse; }
  FATHOM_HD const GenericJoint& generic_joint(std::uint32_t slot) const { return joints->generic[slot]; }
  FATHOM_HD const GenericImpulse& generic_impulse(std::uint32_t slot) const { return joints->generic_impulses[slot]; }
  FATHOM_HD void store(std::uint32_t slot, Vec3 last, Vec3 total) const {
    joints->records[slot].impulse = last, joints->records[slot].total = total;
  }
  FATHOM_HD void store(std::uint32_t slot, const GenericImpulse& impulse) const {
    joints->generic_impulses[slot] = impulse;
  }
  FATHOM_HD float push_out_velocity() const { return push_out; }
  FATHOM_HD SpeedLimits limits(float /*h*/) const { return speed_limits; }
};

template <class BodySet, class JointSet>
FATHOM_HD MechanismSolver<LinkedBodies<BodySet, JointSet>> direct_solver(const BodySet& bodies, const JointSet& joints,
                                                                         const Mechanisms<mechanism_states>& m,
                                                                         float push_out = 0, SpeedLimits limits = {}) {
  return {{&bodies, &joints, &m, push_out, limits}, m.links, m.levels, m.closures};
}

/// Replaces the mechanisms by those the host has found. Does nothing while the simulator is stopped: they are submitted
/// again.
struct TakeMechanisms {
  MechanismArrays to;
  MechanismTables from;
  Counters* counters;

  FATHOM_HD void operator()(std::uint32_t k) const {
    if (counters->stopped) return;
    if (k == 0) counters->mechanisms = from.count, counters->mechanism_links = from.link_count;
    if (k < from.link_count) to.links[k] = from.links[k];
    if (k < from.count) to.records[k] = from.records[k];
    if (k < from.level_count) to.levels[k] = from.levels[k];
    if (k < to.joint_capacity) to.of_joint[k] = k < from.joint_count ? from.of_joint[k] : none;
  }
};

/// Checks, for each link, whether its body allows the mechanism to be solved directly in this step and to swing, and
/// the inertia that the body needs.
struct CheckLinks {
  Bodies<body_supports> bodies;
  Joints<> joints;
  Mechanisms<mechanism_records> mechanisms;
  Counters* counters;

  FATHOM_HD void operator()(std::uint32_t i) const {
    if (counters->stopped) return;
    const MechanismLink& link = mechanisms.links[i];
    const std::uint32_t flags = bodies.flags[link.body];
    MechanismRecord& record = mechanisms.records[link.mechanism];
    const bool is_solved = flags & awake_flag && !(flags & isolated_flag);
    if (!is_solved) exec::atomic_store(record.is_blocked, 1u);
    if (link.is_copy()) return;
    if (is_solved && is_in_contact(link.body)) {
      const float inertia = link.min_inertia(inverse_mass(link.body));
      require(link.body, max(inertia, inertia_where_torn(*this, mechanisms.links, i)));
    }
    if (bodies.touching[link.body] != link.joints() || flags & forced_flag) exec::atomic_store(record.is_acted_on, 1u);
  }

  // For `inertia_where_torn`.
  FATHOM_HD JointEnds joint(std::uint32_t slot) const { return JointEnds(joints.records[slot]); }
  FATHOM_HD const GenericJoint& generic_joint(std::uint32_t slot) const { return joints.generic[slot]; }
  FATHOM_HD const Pose& pose(std::uint32_t i) const { return bodies.poses[i]; }
  FATHOM_HD float inverse_mass(std::uint32_t i) const { return bodies.constants[i].inverse_mass; }
  FATHOM_HD float radius(std::uint32_t i) const { return bodies.constants[i].radius; }

 private:
  FATHOM_HD bool is_in_contact(std::uint32_t body) const {
    return (bodies.colours[body] & ~bodies.joint_colours[body]) | (counters->any_further ? bodies.further[body] : 0);
  }
  FATHOM_HD void require(std::uint32_t body, float inertia) const {
    if (!(inertia > 1)) return;
    BodyLoad& load = bodies.support[body].load;
    load.inertia_scale = max(load.inertia_scale, inertia);
    exec::atomic_store(counters->loaded_step, counters->step);
  }
};

/// Reads joints and bodies of directly solved mechanisms.
struct PrepareMechanisms {
  Bodies<> bodies;
  Joints<> joints;
  Mechanisms<mechanism_states> mechanisms;
  Counters* counters;

  FATHOM_HD void operator()(std::uint32_t i) const {
    if (counters->stopped) return;
    const MechanismRecord& record = mechanisms.records[mechanisms.links[i].mechanism];
    if (!record.is_direct()) return;
    if (record.tree.first == i) exec::atomic_add(counters->direct, 1u);
    direct_solver(bodies, joints, mechanisms).prepare_link(i);
  }
};

/// Stores the joints' impulses.
struct StoreMechanisms {
  Bodies<> bodies;
  Joints<joint_records, joint_impulses> joints;
  Mechanisms<mechanism_states> mechanisms;
  const Counters* counters;

  FATHOM_HD void operator()(std::uint32_t i) const {
    if (counters->stopped || !mechanisms.records[mechanisms.links[i].mechanism].is_direct()) return;
    direct_solver(bodies, joints, mechanisms).store_link(i);
  }
};

/// After it, even if the step has stopped.
struct ClearMechanisms {
  Mechanisms<mechanism_records> mechanisms;

  FATHOM_HD void operator()(std::uint32_t m) const {
    MechanismRecord& record = mechanisms.records[m];
    record.is_blocked = record.is_acted_on = 0;
  }
};

}  // namespace fathom::device
