// Operations of steps on mechanisms, other than solving (device/solve_directly.hpp).
#pragma once

#include "check/check.hpp"
#include "device/constraint_rows.hpp"
#include "device/contact_arrays.hpp"
#include "device/mechanism_arrays.hpp"
#include "device/solve_parameters.hpp"
#include "device/union_find.hpp"
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
/// Where nothing is solved.
struct NoConstraints {};

template <class BodySet, class JointSet, class ConstraintSet = NoConstraints>
struct LinkedBodies {
  const BodySet* bodies;
  const JointSet* joints;
  const Mechanisms<mechanism_states>* mechanisms;
  const ConstraintSet* constraints = nullptr;
  const SolveParameters* parameters = nullptr;

  FATHOM_HD LinkState& state(std::uint32_t i) const { return mechanisms->states[i]; }
  FATHOM_HD JointLink& generic(std::uint32_t number) const { return mechanisms->generic[number]; }
  FATHOM_HD SolverBody body(std::uint32_t /*i*/, const MechanismLink& link) const { return solver_body(link.body); }
  FATHOM_HD SolverBody solver_body(std::uint32_t i) const { return bodies->solver[i].body(); }
  FATHOM_HD void set_velocity(std::uint32_t /*i*/, const MechanismLink& link, Vec3 linear, Vec3 angular) const {
    set_velocity(link.body, linear, angular);
  }
  FATHOM_HD void set_velocity(std::uint32_t body, Vec3 linear, Vec3 angular) const {
    SolverQuads& to = bodies->solver[body];
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
  FATHOM_HD bool swings(const MechanismLink& link) const { return mechanisms->records[link.mechanism].swings(); }
  FATHOM_HD Vec3 swing(const MechanismLink& link) const {
    return swings(link) ? bodies->motion[link.body].acceleration : Vec3{};
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

  FATHOM_HD bool solves_contacts(std::uint32_t mechanism) const {
    return leads_to_contact(mechanisms->records[mechanism].tree.first);
  }
  FATHOM_HD bool leads_to_contact(std::uint32_t i) const { return mechanisms->contacts[i].leads != 0; }
  FATHOM_HD bool has_contacts(std::uint32_t i) const { return mechanisms->contacts[i].count > 0; }
  FATHOM_HD LinkPushes& pushes(std::uint32_t i) const { return mechanisms->pushes[i]; }
  /// Calls act(state, constraint, head, other body) for each of a link's contacts.
  template <class Act>
  FATHOM_HD void each_contact(std::uint32_t i, const Act& act) const {
    const LinkContacts& contacts = mechanisms->contacts[i];
    for (std::uint32_t n = 0; n < contacts.count; ++n) {
      const std::uint32_t k = contacts.constraints[n];
      const ConstraintHead head = constraints->heads[k];
      act(mechanisms->contact_states[i].contacts[n], k, head, head.b == mechanisms->links[i].body ? head.a : head.b);
    }
  }
  FATHOM_HD void begin_contacts(std::uint32_t i, const LinkResponse& response) const {
    const ContactBody<LinkResponse> link{{}, {}, 1, response};
    each_contact(i, [&](LinkContactState& state, std::uint32_t k, const ConstraintHead& head, std::uint32_t other) {
      LinkContact contact = load_link_contact(k, head, other);
      state.impulses = contact.rows.impulses;
      state.sum = state.impulses.sum();
      state.before.linear = contact.other.linear, state.before.angular = contact.other.angular;
      if (contact.is_pushable)
        weigh_link_contact<true>(contact, link);
      else
        weigh_link_contact<false>(contact, link);
      state.masses = LinkContactMasses::of(contact.rows);
    });
  }
  FATHOM_HD void end_contacts(std::uint32_t i, bool ends_substep) const {
    each_contact(i, [&](const LinkContactState& state, std::uint32_t k, const ConstraintHead&, std::uint32_t) {
      ContactImpulses impulses = state.impulses;
      if (ends_substep) impulses.step = step_impulse_with(impulses.step, state.sum, impulses.sum());
      Quad* const rows = rows_of(*constraints, k);
      store_normal_impulses(rows, impulses);
      store_friction_impulses(rows, impulses);
    });
  }
  FATHOM_HD void take_back_contacts(std::uint32_t i) const {
    each_contact(i, [&](const LinkContactState& state, std::uint32_t, const ConstraintHead& head, std::uint32_t other) {
      if (!(head.bits & pushes_fixed_bit)) set_velocity(other, state.before.linear, state.before.angular);
    });
  }
  // Sweeps find obstacles where they are.
  FATHOM_HD static void move_obstacles(std::uint32_t, float) {}
  template <ContactPass pass>
  FATHOM_HD Wrench sweep_contacts(std::uint32_t i, ContactBody<LinkResponse>& link) const {
    Wrench sum;
    each_contact(i, [&](LinkContactState& state, std::uint32_t k, const ConstraintHead& head, std::uint32_t other) {
      LinkContact contact = load_link_contact(k, head, other);
      contact.rows.impulses = state.impulses;
      state.masses.put_into(contact.rows);
      if (contact.is_pushable) {
        sum += sweep_link_contact<pass, true>(contact, link, parameters->friction_lead);
        set_velocity(other, contact.other.linear, contact.other.angular);
      } else {
        sum += sweep_link_contact<pass, false>(contact, link, parameters->friction_lead);
      }
      state.impulses = contact.rows.impulses;
    });
    return sum;
  }
  FATHOM_HD LinkContact load_link_contact(std::uint32_t k, const ConstraintHead& head, std::uint32_t other_body) const {
    Quad* const rows = rows_of(*constraints, k);
    Quad q[row_count];
    for (std::uint32_t r = 0; r < row_count; ++r) q[r] = rows[r * tile_width];
    LinkContact contact;
    load_contact(q, static_cast<int>(head.bits & point_bits), contact.rows);
    contact.rows.bounce.restitution = head.bits & bounces_bit ? 1.0f : 0.0f;
    contact.soft = link_contact_step(parameters->h, parameters->push_out_velocity);
    const SolverBody other = solver_body(other_body);
    contact.other.linear = other.linear, contact.other.angular = other.angular;
    contact.other.moved = other.moved, contact.other.turned = other.turned;
    contact.link_is_a = other_body == head.b;
    contact.is_pushable = !(head.bits & pushes_fixed_bit);
    contact.on_surface = head.has(row_extra);
    if (contact.on_surface) contact.surface = constraints->extras[k].surface;
    if (contact.is_pushable) {
      contact.other.inverse_mass = 1;
      contact.other.inverse_inertia = free_response(
          other.inverse_mass, world_inertia<SymMat3>(*bodies, other_body, other.inverse_mass, other.inverse_inertia));
    }
    return contact;
  }
  FATHOM_HD float push_out_velocity() const { return parameters->push_out_velocity; }
  FATHOM_HD SpeedLimits limits(float /*h*/) const { return parameters->limits; }
};

template <class BodySet, class JointSet>
FATHOM_HD MechanismSolver<LinkedBodies<BodySet, JointSet>> direct_solver(const BodySet& bodies, const JointSet& joints,
                                                                         const Mechanisms<mechanism_states>& m) {
  return {{&bodies, &joints, &m}, m.links, m.levels, m.closures};
}
template <class BodySet, class JointSet, class ConstraintSet>
FATHOM_HD MechanismSolver<LinkedBodies<BodySet, JointSet, ConstraintSet>> direct_solver(
    const BodySet& bodies, const JointSet& joints, const Mechanisms<mechanism_states>& m,
    const ConstraintSet& constraints, const SolveParameters& parameters) {
  return {{&bodies, &joints, &m, &constraints, &parameters}, m.links, m.levels, m.closures};
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
    if (k < from.link_count) {
      to.links[k] = from.links[k];
      to.contacts[k].count = to.contacts[k].leads = 0;
      if (!from.links[k].is_copy()) to.of_body[from.links[k].body] = k;
    }
    if (k < from.count) to.records[k] = from.records[k];
    if (k < from.level_count) to.levels[k] = from.levels[k];
    if (k < to.joint_capacity) to.of_joint[k] = k < from.joint_count ? from.of_joint[k] : none;
  }
};

/// Lists the contacts that mechanisms are to solve: first those with obstacles; if there are any with free bodies, then
/// clusters of the mechanisms that push the same ones, and these contacts.
struct ListLinkContacts {
  static constexpr bool ends_at_empty_phase = true;
  static constexpr std::uint32_t group_size = 128;
  static constexpr std::uint32_t max_phases = 5;

  Bodies<> bodies;
  Contacts<> contacts;
  Constraints<> constraints;
  Mechanisms<mechanism_records> mechanisms;
  Counters* counters;
  float dt;  ///< s

  FATHOM_HD std::uint32_t phases() const { return counters->stopped ? 0 : max_phases; }
  FATHOM_HD std::uint32_t items(std::uint32_t phase) const {
    if (phase == 0) return counters->constraints;
    if (exec::atomic_load(counters->pushed_step) != counters->step) return 0;
    return phase == gather ? counters->mechanisms : counters->constraints;
  }
  FATHOM_HD void operator()(std::uint32_t phase, std::uint32_t k) const {
    if (phase == gather) return gather_cluster(k);
    const Found found = find(k);
    if (found.link == none) return;
    if (phase == begin) {
      if (found.free == none) {
        exec::atomic_store(mechanisms.records[mechanism_of(found)].stands, 1u);
        return add(found.link, k);
      }
      mechanisms.parents[mechanism_of(found)] = mechanism_of(found);
      mechanisms.pushed_by[found.free] = none;
      exec::atomic_store(counters->pushed_step, counters->step);
    } else if (found.free == none) {
      return;
    } else if (phase == claim) {
      exec::atomic_min(mechanisms.pushed_by[found.free], mechanism_of(found));
      exec::atomic_store(mechanisms.records[mechanism_of(found)].leader, mechanism_of(found));
    } else if (phase == join) {
      unite(mechanisms.parents, mechanisms.pushed_by[found.free], mechanism_of(found));
    } else {
      const MechanismRecord& record = mechanisms.records[mechanism_of(found)];
      if (mechanisms.records[record.leader].has_small_cluster()) add(found.link, k);
    }
  }

 private:
  enum Phase : std::uint32_t { begin, claim, join, gather, append };

  struct Found {
    std::uint32_t link = none;
    std::uint32_t free = none;  ///< a body, or none: an obstacle
  };
  FATHOM_HD std::uint32_t mechanism_of(const Found& found) const { return mechanisms.links[found.link].mechanism; }

  /// The link that constraint k is a contact of, if its mechanism is to solve it.
  FATHOM_HD Found find(std::uint32_t k) const {
    const std::uint32_t number = constraints.contact[k];
    if (number & joint_tag) return {};
    const Contact& contact = contacts.contacts[number];
    if (contact.ahead() || contact.colour() == overflow_colour) return {};
    const PairRecord pair = constraints.bodies[k];
    const bool fixed_a = contact.fixed_a();
    const std::uint32_t a = fixed_a ? none : mechanisms.link_of(pair.a, counters->mechanism_links);
    const std::uint32_t b = mechanisms.link_of(pair.b, counters->mechanism_links);
    if ((a == none) == (b == none)) return {};
    const Found found{a == none ? b : a, fixed_a ? none : a == none ? pair.a : pair.b};
    if (found.free != none && bodies.joint_colours[found.free] != 0) return {};
    const MechanismLink& link = mechanisms.links[found.link];
    const float impulse = contacts.manifolds[constraints.manifold[k]].step_impulse;
    const float inverse_mass = bodies.constants[link.body].inverse_mass, fall = length(counters->gravity) * dt;
    const bool is_solved =
        found.free == none ? is_for_mechanism(link, impulse, inverse_mass, fall)
                           : is_for_mechanism(impulse, inverse_mass + bodies.constants[found.free].inverse_mass, fall);
    return is_solved ? found : Found{};
  }
  FATHOM_HD void add(std::uint32_t link, std::uint32_t k) const {
    LinkContacts& list = mechanisms.contacts[link];
    const std::uint32_t n = exec::atomic_add(list.count, 1u);
    if (n < LinkContacts::most) list.constraints[n] = k;
  }
  FATHOM_HD void gather_cluster(std::uint32_t m) const {
    MechanismRecord& record = mechanisms.records[m];
    if (record.leader == none) return;
    record.leader = root_of(mechanisms.parents, m);
    MechanismRecord& leader = mechanisms.records[record.leader];
    const std::uint32_t n = exec::atomic_add(leader.cluster_size, 1u);
    if (n < max_cluster) leader.cluster[n] = m;
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
    if (link.obstacle != none) exec::atomic_store(record.stands, 1u);
    if (link.is_copy()) return;
    const bool solves_contacts = take_contacts(i);
    if (is_solved && is_in_contact(link.body)) {
      const float inertia = solves_contacts ? 1.0f : link.min_inertia(inverse_mass(link.body));
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
  /// Puts the link's contacts in order: each has a colour of its own.
  FATHOM_HD bool take_contacts(std::uint32_t i) const {
    LinkContacts& list = mechanisms.contacts[i];
    if (list.count > LinkContacts::most) list.count = 0;
    for (std::uint32_t n = 1; n < list.count; ++n)
      for (std::uint32_t k = n; k > 0 && list.constraints[k] < list.constraints[k - 1]; --k) {
        const std::uint32_t other = list.constraints[k];
        list.constraints[k] = list.constraints[k - 1], list.constraints[k - 1] = other;
      }
    if (list.count == 0) return false;
    for (std::uint32_t k = i; k != none; k = mechanisms.links[k].parent)
      exec::atomic_store(mechanisms.contacts[k].leads, 1u);
    return true;
  }
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
    record.is_blocked = record.is_acted_on = record.stands = record.cluster_size = 0;
    record.leader = none;
    for (std::uint32_t i = record.tree.first; i < record.tree.end; ++i)
      mechanisms.contacts[i].count = mechanisms.contacts[i].leads = 0;
  }
};

}  // namespace fathom::device
