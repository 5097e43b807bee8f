// Mechanisms: bodies that rigid joints connect to a tree, solved directly (dynamics/joint_tree.hpp) where sweeps would
// be too soft. Pure, for host and device.
//
// A direct solution replaces the joints' rows in a sweep, after those of the contacts: bodies leave it with velocities
// that satisfy all joints. Its substep is that of the rows (dynamics/ball_joint-inl.hpp).
//
// A loop is cut at one of its bodies, which gets a copy in the tree (dynamics/loop_closure.hpp).
//
// One team (math/team.hpp) solves a mechanism; its work-items share the links. Each link adds up its children's
// contributions in their order, so that no result depends on the team.
#pragma once

#include <cstdint>

#include "dynamics/link_contact.hpp"
#include "dynamics/link_solver.hpp"
#include "dynamics/loop_closure.hpp"
#include "math/team.hpp"

namespace fathom {

/// Solves mechanisms of the bodies and joints that `Access` knows. Besides what LinkSolver requires, it provides
///
///     solver_body(slot): SolverBody
///     is_isotropic(slot), inverse_mass(slot), inertia(slot): its own, without the inertia added for loads; pose(slot)
///     swings(link): whether its body swings;  swing(link): m/s² of a body that does, or 0
///     joint(j): {a, b, anchor_a, anchor_b};  last_impulse(j), generic_joint(j), generic_impulse(j)
///     store(j, last, total);  store(j, GenericImpulse)
///     solves_contacts(mechanism); leads_to_contact(i): the link, or one below it, has contacts that the mechanism
///     solves; has_contacts(i)
///     pushes(i): LinkPushes&;  sweep_contacts<pass>(i, link): Wrench (`sweep_link_contact`)
///     begin_contacts(i, response): before the impulses of a link's contacts change; then
///     end_contacts(i, ends_substep), or take_back_contacts(i) if the changes are not to count
///     move_obstacles(mechanism, h): of those contacts
template <class Access>
class MechanismSolver : public LinkSolver<Access> {
 public:
  using Base = LinkSolver<Access>;
  using Base::access, Base::generic, Base::has_generic, Base::links, Base::none, Base::state;

  const std::uint32_t* levels;
  float* closures;

  FATHOM_HD MechanismSolver(const Access& of, const MechanismLink* all_links, const std::uint32_t* all_levels,
                            float* all_closures)
      : Base{of, all_links}, levels(all_levels), closures(all_closures) {}

  /// Reads joints and bodies at the start of the step.
  FATHOM_HD void prepare(const Mechanism& m) const {
    each(m, [&](std::uint32_t i) { prepare_link(i); });
  }
  /// Applies the last step's impulses, or forgets them. Along arms that have turned since, they may spin a thin rod
  /// about its axis several times per substep, which contacts would mistake for surface speed; then all of them are
  /// dropped. Unless the bodies swing, this then returns false: `pull_together` has to find new ones at
  /// once. Contacts have been given theirs, and a sweep would find a light link that carries a heavy one at hundreds of
  /// m/s.
  FATHOM_HD bool warm_start(const Mechanism& m, float h, bool forgets) const {
    let_closures_go(m);
    if (forgets) {
      each(m, [&](std::uint32_t i) { forget_link(i); });
    } else if (all(m, [&](std::uint32_t i) { return this->is_carried_slowly(i, h); })) {
      each(m, [&](std::uint32_t i) { this->give_carried(i, 1); });
    } else {
      each(m, [&](std::uint32_t i) { this->let_go(i); });
      return access.swings(links[m.first]);
    }
    return true;
  }
  /// Before positions move.
  FATHOM_HD void pull_together(const Mechanism& m, float h) const { solve<true>(m, h); }
  /// The rest of that for a mechanism that has looked ahead, where its anchors do not meet.
  FATHOM_HD void come_to_rest_anew(const Mechanism& m, float h) const {
    start_anew(m, h);
    finish<true>(m, h, false);
  }
  /// After positions have moved.
  FATHOM_HD void relax(const Mechanism& m, float h) const {
    each(m, [&](std::uint32_t i) { this->move_obstacle(i, h); });
    if (team::is_leader()) access.move_obstacles(links[m.first].mechanism, h);
    solve<false>(m, h);
  }
  FATHOM_HD void store(const Mechanism& m) const {
    each(m, [&](std::uint32_t i) { store_link(i); });
  }

  FATHOM_HD void prepare_link(std::uint32_t i) const {
    const MechanismLink& link = links[i];
    const std::uint32_t copies = link.is_copy() ? links[link.original].copies : link.copies;
    // Includes the inertia added for loads.
    const float mass = 1 / (static_cast<float>(copies + 1) * access.solver_body(link.body).inverse_mass);
    const LinkStart body = start_of(link.body);
    this->begin_body(i, mass, mass * access.inverse_mass(link.body) * access.inertia(link.body), body,
                     flag(access.is_isotropic(link.body)));
    if (link.joint == none) return;
    const auto j = access.joint(link.joint);
    const LinkStart parent = start_of(link.is_b ? j.a : j.b);
    const Vec3 anchor = link.is_b ? j.anchor_b : j.anchor_a, parent_anchor = link.is_b ? j.anchor_a : j.anchor_b;
    if (has_generic(i))
      this->begin_generic(i, access.generic_joint(link.joint), body, parent, anchor, parent_anchor, pull_of(link),
                          access.generic_impulse(link.joint), access.solves_contacts(link.mechanism));
    else
      this->begin_ball(i, body, parent, anchor, parent_anchor, pull_of(link), access.last_impulse(link.joint));
  }
  FATHOM_HD void store_link(std::uint32_t i) const {
    const MechanismLink& link = links[i];
    if (link.joint == none) return;
    const BallJointRow<float>& row = state(i).row;
    if (has_generic(i))
      access.store(link.joint, generic(i).impulse());
    else
      access.store(link.joint, this->on_body(i, row.impulse), this->on_body(i, row.total));
  }

  /// Before positions move (`soft`) or after, for bodies and obstacles at their current positions.
  template <bool soft>
  FATHOM_HD void solve(const Mechanism& m, float h) const {
    turn_all(m, !soft);
    const bool looks_ahead = soft && all(m, [&](std::uint32_t i) { return this->turns_slowly(i, h); });
    if (soft && !looks_ahead) start_anew(m, h);
    const bool has_contacts = access.solves_contacts(links[m.first].mechanism);
    if (soft) each(m, [&](std::uint32_t i) { this->set_closing(i, m.mass, has_contacts); });
    finish<soft>(m, h, looks_ahead);
  }
  template <bool soft>
  FATHOM_HD void finish(const Mechanism& m, float h, bool looks_ahead) const {
    const bool has_contacts = access.solves_contacts(links[m.first].mechanism);
    const bool follows = solve_with_limits<soft>(m, h, looks_ahead, has_contacts);
    if (all(m, [&](std::uint32_t i) { return this->is_sound(i, h); })) {
      if (soft) each(m, [&](std::uint32_t i) { this->note_pressed(i, h, has_contacts); });
      apply_all<soft>(m, h, follows);
      if (has_contacts) each_with_contacts(m, [&](std::uint32_t i) { access.end_contacts(i, !soft); });
      return;
    }
    if (has_contacts) take_back_contacts(m);
    if (!all(m, [&](std::uint32_t i) { return carries_finite(i); })) {
      forget(m);
    } else if (soft) {
      start_anew(m, h);
      each(m, [&](std::uint32_t i) { state(i).dropped = {}; });
    }
  }

 private:
  // --- division of work ---------------------------------------------------------------------------------------------

  template <class Act>
  FATHOM_HD static void each(const Mechanism& m, const Act& act) {
    for (std::uint32_t i = m.first + team::item(); i < m.end; i += team::items) act(i);
    team::sync();
  }
  template <class Act>
  FATHOM_HD void each_with_contacts(const Mechanism& m, const Act& act) const {
    each(m, [&](std::uint32_t i) {
      if (access.has_contacts(i)) act(i);
    });
  }
  template <class Test>
  FATHOM_HD static bool all(const Mechanism& m, const Test& test) {
    bool holds = true;
    for (std::uint32_t i = m.first + team::item(); i < m.end; i += team::items) holds = test(i) && holds;
    return team::all(holds);
  }
  template <class Act>
  FATHOM_HD void each_of_level(const Mechanism& m, std::uint32_t level, const Act& act) const {
    const std::uint32_t first = levels[m.level + level], end = levels[m.level + level + 1];
    for (std::uint32_t i = first + team::item(); i < end; i += team::items) act(i);
    team::sync();
  }
  template <class Act>
  FATHOM_HD void from_leaves(const Mechanism& m, const Act& act) const {
    for (std::uint32_t level = m.levels; level-- > 0;) each_of_level(m, level, act);
  }
  template <class Act>
  FATHOM_HD void from_root(const Mechanism& m, const Act& act) const {
    for (std::uint32_t level = 0; level < m.levels; ++level) each_of_level(m, level, act);
  }

  // --- a step ----------------------------------------------------------------------------------------------------

  /// m/s², for bodies that swing: acceleration of the link's body relative to its parent
  FATHOM_HD Vec3 pull_of(const MechanismLink& link) const {
    return access.swing(link) - (link.parent != none ? access.swing(links[link.parent]) : Vec3{});
  }
  FATHOM_HD LinkStart start_of(std::uint32_t slot) const {
    const Pose& pose = access.pose(slot);
    const auto& body = access.solver_body(slot);
    return {pose.position, {pose.rotation.w, pose.rotation.vector()}, body.linear, body.angular};
  }
  /// Whether the link's body, without the carried impulses, would be within the speed limits.
  FATHOM_HD bool is_sound_without_carried(std::uint32_t i, float h) const {
    if (links[i].is_copy()) return true;
    const SolverBody body = access.body(i, links[i]);
    const TreeChange without = this->with_carried(i, -1, {body.linear, body.angular});
    const SpeedLimits limits = access.limits(h);
    return length(without.linear) <= limits.linear && length(without.angular) <= limits.angular;
  }
  FATHOM_HD bool carries_finite(std::uint32_t i) const {
    return is_finite(this->sum_of(this->force_of(i)) + this->sum_of(state(i).moment + state(i).parent_moment));
  }
  /// Keeps a body's NaN or infinity from reaching other bodies.
  FATHOM_HD void forget_link(std::uint32_t i) const {
    BallJointRow<float>& row = state(i).row;
    row.impulse = row.total = state(i).moment = state(i).parent_moment = {};
    if (has_generic(i)) generic(i).forget();
    state(i).dropped = {};
  }

  // --- a solution ------------------------------------------------------------------------------------------------

  /// Removes the effect of the last substep's impulses. Along arms that have turned they would cancel only up to
  /// rounding, from which light bodies on long arms make ever larger impulses. Not where a rod has turned so far that
  /// removing them would spin it about its axis: they never gave it that spin, and it would be thrown the other way.
  FATHOM_HD void start_anew(const Mechanism& m, float h) const {
    if (all(m, [&](std::uint32_t i) { return is_sound_without_carried(i, h); }))
      each(m, [&](std::uint32_t i) { this->give_carried(i, -1); });
    each(m, [&](std::uint32_t i) { this->let_go(i); });
    let_closures_go(m);
    turn_all(m, false);
  }
  FATHOM_HD void forget(const Mechanism& m) const {
    each(m, [&](std::uint32_t i) { forget_link(i); });
    let_closures_go(m);
  }

  /// Solves so that anchors meet at the substep's end, or that they do not move against each other. The latter never
  /// adds energy, except for the share of gaps that it closes, whatever the arms do within the substep; where looking
  /// ahead does not make anchors meet, it takes its place. Starts again where the result activates other limits or
  /// saturates drives, which the first round usually shows. Where revisions do not settle, and where positions have
  /// moved, drives alone are still held to their largest force: each time at least one more, so this ends.
  ///
  /// Then come sweeps over the contacts together with all joints, which keep the limits and drives that they have
  /// found. But a motor that would have to give more than its largest force against the contacts is put at that force,
  /// and all is solved again. Friction may hold more for a substep: it drives nothing.
  ///
  /// One loop for all of this, because a GPU's instruction cache does not hold the solution twice. Returns whether the
  /// substep follows all swings.
  template <bool soft>
  FATHOM_HD bool solve_with_limits(const Mechanism& m, float h, bool looks_ahead, bool has_contacts) const {
    bool is_settled = false;
    for (int revision = 0;; ++revision) {
      const auto has_to_revise = [&] {
        if (is_settled) return false;
        return soft && revision < max_revisions ? revise(m, h) : restrain(m, false);
      };
      const bool follows = eliminate_all<soft>(m, h);
      if (looks_ahead)
        take_first_round(m, h);
      else
        come_to_rest<soft>(m, h);
      if (has_to_revise() || (looks_ahead && take_more_rounds(m, h) && has_to_revise())) {
        take_back(m, follows);
        continue;
      }
      if (looks_ahead && !is_settled && !all(m, [&](std::uint32_t i) { return this->does_meet(i, h); })) {
        start_anew(m, h);
        looks_ahead = false, revision = -1;
        continue;
      }
      is_settled = true;
      if (!has_contacts) return follows;
      sweep_contacts<soft>(m);
      if (!restrain(m, true)) return follows;
      take_back_contacts(m);
      take_back(m, follows);
    }
  }
  /// Also sets the loads to the impulses that bodies carry over. Returns whether the substep follows all swings.
  template <bool soft>
  FATHOM_HD bool eliminate_all(const Mechanism& m, float h) const {
    from_leaves(m, [&](std::uint32_t i) { this->eliminate(i); });
    const bool follows = !soft || all(m, [&](std::uint32_t i) { return this->can_follow(i, h); });
    if (!follows) {
      each(m, [&](std::uint32_t i) { stiffen(i, h); });
      from_leaves(m, [&](std::uint32_t i) { this->eliminate(i); });
    }
    if (m.closures > 0) find_responses(m);
    if constexpr (soft) each(m, [&](std::uint32_t i) { this->load_carried(i); });
    if (!follows) each(m, [&](std::uint32_t i) { load_stiffened(i, h); });
    return follows;
  }
  FATHOM_HD void take_first_round(const Mechanism& m, float h) const {
    look_ahead(m, h);
    aim_ahead(m, h);
    substitute(m, 1);
    look_ahead(m, h);
  }
  /// Takes up to `newton_rounds` rounds in all while another one helps. Returns whether any was taken.
  FATHOM_HD bool take_more_rounds(const Mechanism& m, float h) const {
    for (int round = 1; round < newton_rounds; ++round) {
      aim_ahead(m, h);
      if (m.closures == 0 && all(m, [&](std::uint32_t i) { return this->is_aimed_within(i, aimed_share, h); }))
        return round > 1;
      substitute(m, 1);
      look_ahead(m, h);
    }
    return true;
  }
  template <bool soft>
  FATHOM_HD void come_to_rest(const Mechanism& m, float h) const {
    each(m, [&](std::uint32_t i) { this->aim_at_rest(i, soft ? projection_share : 0.0f, h); });
    substitute(m, closing_rounds);
  }
  FATHOM_HD void look_ahead(const Mechanism& m, float h) const {
    each(m, [&](std::uint32_t i) { Base::look_ahead(i, h); });
  }
  FATHOM_HD void aim_ahead(const Mechanism& m, float h) const {
    each(m, [&](std::uint32_t i) { Base::aim_ahead(i, h); });
  }
  FATHOM_HD bool revise(const Mechanism& m, float h) const {
    return !all(m, [&](std::uint32_t i) { return !Base::revise(i, h, true); });
  }
  FATHOM_HD bool restrain(const Mechanism& m, bool motors_only) const {
    return !all(m, [&](std::uint32_t i) { return !Base::restrain(i, motors_only); });
  }

  FATHOM_HD void turn_all(const Mechanism& m, bool relaxes) const {
    each(m, [&](std::uint32_t i) { this->turn(i); });
    each(m, [&](std::uint32_t i) { this->turn_joint(i, relaxes); });
  }
  /// Discards a solution, to start again with other limits. One that `follows` all swings has stiffened no body.
  FATHOM_HD void take_back(const Mechanism& m, bool follows) const {
    each(m, [&](std::uint32_t i) { follows ? this->turn_back(i) : this->turn(i); });
    each(m, [&](std::uint32_t i) { this->choose_coordinates(i); });
  }

  /// Adds the resistance of a body's pulls to its turning (see `stiffness`).
  FATHOM_HD void stiffen(std::uint32_t i, float h) const {
    LinkState& body = state(i);
    body.is_eliminated = Flag{};
    this->each_pull(i, h, [&](Vec3 arm, float k) {
      const Vec3 axis = normalize(arm);
      const Mat3 outer{axis.x * axis, axis.y * axis, axis.z * axis};
      body.of_body.angular = body.of_body.angular + k * (diagonal(1) - outer);
    });
    if (has_generic(i)) generic(i).stiffen_rope(this->pair_of(i), this->last_pull(i), h);
  }
  /// The load of that stiffness at the body's current motion.
  FATHOM_HD void load_stiffened(std::uint32_t i, float h) const {
    LinkState& body = state(i);
    body.is_eliminated = Flag{};  // apart from the stiffness
    this->each_pull(i, h, [&](Vec3 arm, float k) { body.load.moment -= k * this->across(body.motion.angular, arm); });
  }

  FATHOM_HD void substitute(const Mechanism& m, int rounds) const {
    substitute<LinkPass::aimed>(m);
    for (int round = 0; m.closures > 0 && round < rounds; ++round) close_loops(m);
  }
  template <LinkPass pass>
  FATHOM_HD void substitute(const Mechanism& m) const {
    from_leaves(m, [&](std::uint32_t i) { this->template hand_on<pass>(i); });
    from_root(m, [&](std::uint32_t i) { this->template follow_parent<pass>(i, true); });
  }

  // --- loops -----------------------------------------------------------------------------------------------------

  FATHOM_HD LoopClosure closure_of(const Mechanism& m) const { return {closures + m.closure_memory, m.closures}; }
  /// The link of a mechanism's copy k.
  FATHOM_HD std::uint32_t copy(const Mechanism& m, std::uint32_t k) const { return levels[m.first_closure() + k]; }
  template <class Act>
  FATHOM_HD static void each_closure(const Mechanism& m, const Act& act) {
    for (std::uint32_t k = team::item(); k < m.closures; k += team::items) act(k);
    team::sync();
  }
  FATHOM_HD void let_closures_go(const Mechanism& m) const {
    const LoopClosure closure = closure_of(m);
    each_closure(m, [&](std::uint32_t k) {
      for (std::uint32_t row = 0; row < closure_rows; ++row) closure.total(closure_rows * k + row) = 0;
    });
  }
  /// Motion of a copy relative to the body, row by row.
  FATHOM_HD static void write_difference(const TreeChange& copy, const TreeChange& body, float (&rows)[closure_rows]) {
    const Vec3 linear = copy.linear - body.linear, angular = copy.angular - body.angular;
    rows[0] = linear.x, rows[1] = linear.y, rows[2] = linear.z;
    rows[3] = angular.x, rows[4] = angular.y, rows[5] = angular.z;
  }
  FATHOM_HD void load_closure(const Mechanism& m, std::uint32_t k, const TreeLoad& load) const {
    const std::uint32_t link = copy(m, k);
    TreeLoad &on_copy = state(link).load, &on_body = state(links[link].original).load;
    on_copy.impulse += load.impulse, on_copy.moment += load.moment;
    on_body.impulse -= load.impulse, on_body.moment -= load.moment;
  }

  /// The response of each row to a unit impulse on another: one solution for each, of links without loads.
  FATHOM_HD void find_responses(const Mechanism& m) const {
    const LoopClosure closure = closure_of(m);
    each_closure(m, [&](std::uint32_t k) { begin_closure(m, closure, k); });
    for (std::uint32_t column = 0; column < closure_rows * m.closures; ++column) {
      if (team::is_leader()) {
        const std::uint32_t axis = column % closure_rows;
        const auto unit = [axis](std::uint32_t of) { return axis == of ? 1.0f : 0.0f; };
        load_closure(m, column / closure_rows, {{unit(0), unit(1), unit(2)}, {unit(3), unit(4), unit(5)}});
      }
      team::sync();
      substitute<LinkPass::probing>(m);
      each_closure(m, [&](std::uint32_t k) {
        float rows[closure_rows];
        write_difference(state(copy(m, k)).step, state(links[copy(m, k)].original).step, rows);
        for (std::uint32_t r = 0; r < closure_rows; ++r) {
          const std::uint32_t row = closure_rows * k + r;
          if (row >= column) closure.response(row, column) = rows[r] + (row == column ? closure.softness(row) : 0.0f);
        }
      });
    }
    closure.factorise();
  }
  FATHOM_HD void begin_closure(const Mechanism& m, const LoopClosure& closure, std::uint32_t k) const {
    const std::uint32_t body = links[copy(m, k)].body;
    const SymMat3& inertia = access.inertia(body);
    for (std::uint32_t r = 0; r < closure_rows; ++r) {
      const float alone = r < 3 ? access.inverse_mass(body) : 1 / max(max(inertia.xx, inertia.yy), inertia.zz);
      closure.softness(closure_rows * k + r) = closure_softness * alone;
      closure.more(closure_rows * k + r) = 0;
    }
  }
  /// Copies have moved as their own joints require: removes their motion relative to their bodies.
  FATHOM_HD void close_loops(const Mechanism& m) const {
    const LoopClosure closure = closure_of(m);
    each_closure(m, [&](std::uint32_t k) {
      float rows[closure_rows];
      write_difference(state(copy(m, k)).change, state(links[copy(m, k)].original).change, rows);
      for (std::uint32_t r = 0; r < closure_rows; ++r) closure.error(closure_rows * k + r) = rows[r];
    });
    closure.solve();
    if (team::is_leader())  // a body may have two copies
      for (std::uint32_t k = 0; k < m.closures; ++k) load_closure(m, k, closure.load(k));
    team::sync();
    substitute<LinkPass::closing>(m);
  }

  // --- contacts ----------------------------------------------------------------------------------------------------

  template <bool soft>
  FATHOM_HD void sweep_contacts(const Mechanism& m) const {
    const auto leads = [&](std::uint32_t i) { return access.leads_to_contact(i); };
    from_root(m, [&](std::uint32_t i) {
      if (leads(i)) this->find_response(i);
    });
    each_with_contacts(m, [&](std::uint32_t i) { access.begin_contacts(i, link_response(access.pushes(i))); });
    for (int round = 0; round < link_contact_rounds; ++round) {
      if (team::is_leader())
        this->sweep_along_tree(m.first, m.end, leads, [&](std::uint32_t i) { sweep_contacts_of<soft>(i); });
      team::sync();
      substitute<LinkPass::closing>(m);
      if (m.closures > 0) close_loops(m);
    }
  }
  FATHOM_HD void take_back_contacts(const Mechanism& m) const {
    each_with_contacts(m, [&](std::uint32_t i) { access.take_back_contacts(i); });
  }
  template <bool soft>
  FATHOM_HD void sweep_contacts_of(std::uint32_t i) const {
    if (!access.has_contacts(i)) return;
    const LinkState& s = state(i);
    const auto body = access.body(i, links[i]);
    ContactBody<LinkResponse> link{s.motion.linear + s.step.linear,
                                   turned_back_by(s.spin, s.motion.angular + s.step.angular),
                                   1,
                                   link_response(access.pushes(i)),
                                   body.moved,
                                   body.turned};
    constexpr ContactPass pass = soft ? ContactPass::soft : ContactPass::relax;
    const Wrench sum = access.template sweep_contacts<pass>(i, link);
    this->push_by_contacts(i, sum.force, sum.torque);
  }

  template <bool soft>
  FATHOM_HD void apply_all(const Mechanism& m, float h, bool follows) const {
    each(m, [&](std::uint32_t i) { this->template apply<soft>(i, h, follows); });
    const LoopClosure closure = closure_of(m);
    each_closure(m, [&](std::uint32_t k) {
      for (std::uint32_t row = closure_rows * k; row < closure_rows * (k + 1); ++row)
        closure.total(row) += closure.more(row);
    });
  }
};

}  // namespace fathom
