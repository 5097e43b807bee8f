// solve: all substeps in one kernel, whose phases are sweeps over colours and integrations over bodies.
//
// The same soft step as in the native simulator (native/solver.hpp), contact by contact with the functions of
// dynamics/contact_rows.hpp: warm starting once per step, which later substeps carry in the bodies.
#pragma once

#include "check/check.hpp"
#include "device/constraint_rows.hpp"
#include "device/joint_arrays.hpp"
#include "device/joint_sweeps.hpp"
#include "device/mass_splitting.hpp"
#include "device/solve_parameters.hpp"
#include "dynamics/body_fault.hpp"
#include "dynamics/rotation.hpp"
#include "dynamics/support.hpp"
#include "exec/atomic.hpp"
#include "exec/bits.hpp"
#include "exec/kernel.hpp"
#include "exec/load.hpp"

namespace fathom::device {

/// Constraints that sweeps and direct solutions of supports may write.
using SolvedConstraints = Constraints<constraint_rows, constraint_supports>;

/// The phases of a step, each over one colour or over all bodies:
///
///     integrate velocities, warm start, then for each substep
///       sweeps, integrate positions, sweeps without bias, integrate velocities of the next substep.
///
/// If something may bounce, velocities are integrated after bounce sweeps, and the carried impulses are saved before
/// these, which they must not include.
///
/// A constraint always belongs to one work-item, which can therefore load its rows and impulses while it waits for the
/// previous phase; only bodies are read after the barrier.
///
/// Most steps need no barrier at all on devices that can do without (`Plan::by_data`). A body's quads count how often
/// they were written, and a constraint knows the count that it requires: one for each integration before, one for each
/// sweep and contact of the body, and one for each of its contacts with an earlier colour. So it waits only for its two
/// bodies; a chain of phases costs one store and one load per phase. This does not work if there is an overflow, if
/// colours do not fit into one word, if bounce sweeps skip contacts, or if contacts read bodies whose motion has no
/// write counts.
///
/// Worlds without joints, and those with only ball joints, have separate kernels without the registers that other
/// joints need. Only the kernel that solves directly can split masses in sweeps over the overflow.
template <JointKinds kinds, bool splits = false>
struct SolveConstraints {
  static constexpr std::uint32_t group_size = 256;

  /// `push_first` is a push that starts without impulses.
  enum What : std::uint32_t {
    carry,
    integrate_first_v,
    integrate_v,
    integrate_x,
    warm,
    push_first,
    push,
    relax,
    bounce
  };
  struct Cursor {
    What what;
    std::uint32_t colour;
    std::uint32_t
        round;  ///< number of integrations and sweeps over all colours within the substep, from the first `warm` on
    std::uint32_t substep;
    std::uint32_t bounce_sweeps = 0;  ///< bounce sweeps completed in the substep
    std::uint32_t integrations = 0, sweeps = 0,
                  moves = 0;   ///< completed: all integrations, sweeps over all colours, integrations of positions
    Stretch stretch = {0, 0};  ///< the phase's constraints, or bodies
    SplitPhase split = SplitPhase::outside;
    // Copied from the plan, to be in registers.
    bool by_data = false;
    std::uint32_t colours = 0;
  };

  struct Plan {
    Stretch schedule[schedule_size];
    std::uint32_t sweeps, overflow, bodies, bounces, support_levels;
    std::uint32_t mechanisms;  ///< 0 if none is solved directly
    bool any_kinematic;
    bool by_data;  ///< items wait for their inputs, not for the previous phase

    /// Whether SolveDirectly is due.
    FATHOM_HD bool any_direct() const { return support_levels > 0 || mechanisms > 0 || overflow > 0; }
  };
  static constexpr std::uint32_t plan_parts = schedule_size;

  /// Number of a body's contacts and joints: all, and those with a colour, read if work-items wait for data.
  struct BodyCounts {
    std::uint32_t touching, colours;
  };
  /// A constraint's rows, or the data to integrate a body. No member has a default value: it would be set before each
  /// load.
  struct Fetched {
    union {
      ConstraintHead head;  // of a sweep
      BodyCounts body;      // of an integration
    };
    Quad rows[row_count];
  };

  Bodies<body_data, body_state, body_islands, body_supports, body_solver> bodies;
  SolvedConstraints constraints;
  Counters* counters;
  std::uint32_t body_capacity;
  SolveParameters p;
  const GenericJoint* generic_joints;  ///< by slot
  JointReactions* reactions;           ///< by slot

  SolveConstraints<kinds, true> with_splitting() const {
    return {bodies, constraints, counters, body_capacity, p, generic_joints, reactions};
  }

  FATHOM_HD void plan_part(Plan& plan, std::uint32_t k) const {
    plan.schedule[k] = counters->schedule[k];
    if (k > 0) return;
    // All are loaded at once: each dependent load costs every step a microsecond.
    const std::uint32_t further = counters->further_sweeps;
    plan.sweeps = counters->sweeps;
    plan.overflow = counters->overflow;
    plan.bodies = counters->live_bodies;
    plan.bounces = counters->may_bounce;
    plan.support_levels = counters->support_levels;
    const std::uint32_t direct = kinds == JointKinds::absent ? 0 : counters->direct;
    plan.mechanisms = direct > 0 ? counters->mechanisms : 0;
    plan.any_kinematic = counters->any_kinematic;
    const std::uint32_t any = plan.overflow | plan.bounces | further | direct;
    plan.by_data = exec::can_wait_for_data && !(any | plan.any_kinematic);
  }
  /// In memory-bound kernels, polling for data takes longer.
  FATHOM_HD void keep_barriers(Plan& plan) const { plan.by_data = false; }
  FATHOM_HD bool needs_barriers(const Plan& plan) const { return !plan.by_data; }

  FATHOM_HD std::uint32_t phases(const Plan& plan) const { return plan.any_direct() ? 0 : all_phases(plan); }
  FATHOM_HD std::uint32_t all_phases(const Plan& plan) const {
    if (plan.sweeps == 0) return 0;
    const std::uint32_t n = plan.sweeps + (plan.overflow > 0 ? 2 : 0);
    const std::uint32_t bouncing = plan.bounces ? p.substeps * (max_bounce_sweeps * n + 1) - 1 : 0;
    return (p.warm_start ? n : 0) + p.substeps * of_substep(n) + bouncing;
  }

  FATHOM_HD Cursor cursor_at(const Plan& plan, std::uint32_t phase) const {
    Cursor cursor{plan.bounces ? bounce : integrate_first_v, 0, 0, 0};
    begin(plan, cursor);
    cursor.by_data = plan.by_data;
    cursor.colours = plan.sweeps;
    for (std::uint32_t k = 0; k < phase; ++k) cursor = next(plan, cursor);
    return cursor;
  }

  FATHOM_HD Cursor next(const Plan& plan, Cursor cursor) const {
    if (splits && cursor.split == SplitPhase::count) {
      cursor.split = SplitPhase::act;
      return cursor;
    }
    if (splits && cursor.split == SplitPhase::act) {
      cursor.split = SplitPhase::merge;
      cursor.stretch = {0, plan.bodies};
      return cursor;
    }
    if (is_sweep(cursor) && !ends_sweep(cursor)) {
      cursor.stretch = plan.schedule[++cursor.colour];
      cursor.split = SplitPhase::outside;
      return cursor;
    }
    begin_round(plan, cursor);
    begin(plan, cursor);
    return cursor;
  }

  FATHOM_HD void report_overrun() const { exec::atomic_store(counters->overrun, 1u); }

  FATHOM_HD std::uint32_t items(const Plan&, Cursor cursor) const { return cursor.stretch.count; }

  // Issues all loads at once, whether the contact has that many points or not, so none waits for another. Rows that a
  // sweep does not need are loaded from another row, which costs less than a branch.
  FATHOM_HD_INLINED void fetch(const Plan&, Cursor cursor, std::uint32_t i, Fetched& f) const {
    if (!is_sweep(cursor)) return fetch_body(cursor, i, f);
    if (splits && cursor.split == SplitPhase::merge) return;
    if (cursor.what == bounce && is_calm(cursor)) {
      f = {};
      return;
    }
    const std::uint32_t k = cursor.stretch.first + i;
    const Quad* const rows = rows_of(constraints, k);
    const bool friction =
        with_friction(cursor.what) || kinds == JointKinds::all;  // generic joints have a different layout
    f.head = exec::load_unchanging(constraints.heads[k]);
    constexpr std::uint32_t unchanging = kinds == JointKinds::all     ? generic_written_row
                                         : kinds == JointKinds::balls ? joint_moment_row
                                                                      : impulse_row;
    for (std::uint32_t r = 0; r < unchanging; ++r)
      f.rows[r] = exec::load_unchanging(rows[(r == friction_row && !friction ? 0 : r) * tile_width]);
    for (std::uint32_t r = unchanging; r < impulse_row; ++r) f.rows[r] = rows[r * tile_width];
    f.rows[impulse_row] = rows[impulse_row * tile_width];
    f.rows[impulse_row + 1] = rows[(friction ? impulse_row + 1 : impulse_row) * tile_width];
    f.rows[mass_row] = exec::load_unchanging(rows[mass_row * tile_width]);
  }

  FATHOM_HD_INLINED void operator()(const Plan& plan, Cursor cursor, std::uint32_t i, const Fetched& fetched) const {
    if (cursor.what == carry)
      carry_impulses(i, fetched);
    else if (cursor.what == integrate_v || cursor.what == integrate_first_v)
      integrate_velocity(cursor, i, fetched, plan.bounces > 0);
    else if (cursor.what == integrate_x)
      integrate_position(plan, cursor, i, fetched);
    else if (splits && cursor.split == SplitPhase::merge)
      splitting().merge(i);
    else
      sweep(cursor, cursor.stretch.first + i, fetched);
  }

  FATHOM_HD static bool is_sweep(Cursor cursor) { return cursor.what > integrate_x; }
  /// For a sweep: whether the phase is its last.
  FATHOM_HD static bool ends_sweep(Cursor cursor) {
    return cursor.colour + 1 == cursor.colours &&
           (cursor.split == SplitPhase::outside || cursor.split == SplitPhase::merge);
  }
  FATHOM_HD static bool is_overflow(Cursor cursor) {
    return splits && (cursor.split == SplitPhase::count || cursor.split == SplitPhase::act);
  }

  /// Whether the sweep is the first after positions have moved.
  FATHOM_HD bool has_just_moved(Cursor cursor) const { return cursor.round == p.sweeps_before + 2; }

 private:
  /// Sets the first phase of the cursor's current work.
  FATHOM_HD static void begin(const Plan& plan, Cursor& cursor) {
    cursor.colour = 0;
    cursor.stretch = is_sweep(cursor) ? plan.schedule[0] : Stretch{0, plan.bodies};
    cursor.split = is_sweep(cursor) && plan.overflow > 0 ? SplitPhase::count : SplitPhase::outside;
  }
  /// Continues after all bodies, or all colours.
  FATHOM_HD void begin_round(const Plan& plan, Cursor& cursor) const {
    if (cursor.what == carry) {
      cursor.what = bounce;
      return;
    }
    if (cursor.what == bounce) {
      if (++cursor.bounce_sweeps == max_bounce_sweeps) cursor.what = first_of(cursor);
      return;
    }
    if (is_sweep(cursor))
      ++cursor.sweeps;
    else
      ++cursor.integrations;
    if (cursor.what == integrate_x) ++cursor.moves;
    if (cursor.what == integrate_first_v && p.warm_start) {
      cursor.what = warm;
      return;
    }
    ++cursor.round;
    const std::uint32_t moving = 1 + p.sweeps_before, rounds = moving + 1 + p.sweeps_after;
    if (cursor.round == rounds) {
      cursor.round = 0;
      ++cursor.substep;
    }
    cursor.what = cursor.round < moving ? push : relax;
    if (cursor.round == 0) cursor.what = plan.bounces ? carry : first_of(cursor), cursor.bounce_sweeps = 0;
    if (cursor.round == 1 && !p.warm_start) cursor.what = push_first;
    if (cursor.round == moving) cursor.what = integrate_x;
  }
  /// The kind of velocity integration of a substep.
  FATHOM_HD What first_of(Cursor cursor) const {
    return p.warm_start && cursor.substep > 0 ? integrate_v : integrate_first_v;
  }

  FATHOM_HD static std::uint32_t bounce_index(Cursor cursor) {
    return cursor.substep * max_bounce_sweeps + cursor.bounce_sweeps;
  }
  /// Whether nothing bounced in an earlier bounce sweep: then nothing will. Only the barrier at the end of a sweep
  /// makes its result known to all, and loads for the first colour precede that.
  FATHOM_HD bool is_calm(Cursor cursor) const {
    const std::uint32_t before = cursor.colour > 0 ? 1 : 2, index = bounce_index(cursor);
    return cursor.bounce_sweeps >= before && index < noted_bounce_sweeps &&
           !exec::atomic_load(counters->bounced[index - before]);
  }

  FATHOM_HD std::uint32_t of_substep(std::uint32_t n) const { return (p.sweeps_before + p.sweeps_after) * n + 2; }

  /// Whether a sweep needs friction or the sum over the step, besides the points' rows and impulses.
  FATHOM_HD bool with_friction(What what) const { return what >= warm && !(what == push && p.soft); }

  /// Whether the sweep is its substep's last.
  FATHOM_HD bool ends_substep(Cursor cursor) const {
    return cursor.round == p.sweeps_before + (p.sweeps_after ? 1 + p.sweeps_after : 0);
  }

  FATHOM_HD_INLINED void sweep(Cursor cursor, std::uint32_t k, const Fetched& f) const {
    if constexpr (kinds != JointKinds::absent)
      if (is_joint(f.head.bits) && f.head.has(direct_extra)) return;
    if constexpr (kinds == JointKinds::all)
      if (is_joint(f.head.bits) && f.head.bits & generic_bit) return sweep_generic(cursor, k, f);
    if constexpr (kinds != JointKinds::absent)
      if (is_joint(f.head.bits)) return sweep_joint(cursor, k, f, BallJointSweep(f.rows));
    if (cursor.what == push || cursor.what == push_first)
      sweep_as<push>(cursor, k, f);
    else if (cursor.what == relax)
      sweep_as<relax>(cursor, k, f);
    else if (cursor.what == warm)
      sweep_as<warm>(cursor, k, f);
    else if (f.head.bits & bounces_bit)
      sweep_as<bounce>(cursor, k, f);
  }

  template <What what>
  FATHOM_HD_INLINED void sweep_as(Cursor cursor, std::uint32_t k, const Fetched& f) const {
    if (f.head.bits & anisotropic_bit)
      sweep_with<what, SymMat3>(cursor, k, f);
    else
      sweep_with<what, float>(cursor, k, f);
  }

  /// Whether quads have the required write counts; those of bodies that cannot be pushed are never written.
  FATHOM_HD static bool is_due(const Quad& linear, const Quad& angular, std::uint32_t writes) {
    return writes_of(linear) == writes && writes_of(angular) == writes;
  }

  /// The bodies of a constraint in a sweep.
  struct Pair {
    SolverQuads a, b;
    std::uint32_t due_a, due_b;  ///< required write counts of their velocities
    bool pushes_a, pushes_b;
  };

  /// Loads a constraint's bodies once they are in the state that the sweep requires.
  template <What what>
  FATHOM_HD_INLINED void load_pair(Cursor cursor, const Fetched& fetched, Pair& pair) const {
    const ConstraintHead& head = fetched.head;
    pair.pushes_a = fetched.rows[mass_row].x > 0, pair.pushes_b = fetched.rows[mass_row].z > 0;
    const auto due = [&](std::uint32_t count_shift, std::uint32_t rank_shift) {
      return cursor.integrations + cursor.sweeps * (head.bits >> count_shift & count_bits) +
             (head.bits >> rank_shift & rank_bits);
    };
    pair.due_a = due(count_a_shift, rank_a_shift), pair.due_b = due(count_b_shift, rank_b_shift);
    const SolverQuads &at_a = bodies.solver[head.a], &at_b = bodies.solver[head.b];
    for (exec::Patience patience;; patience.look_again()) {
      pair.a.linear = exec::load_shared_quad(at_a.linear), pair.b.linear = exec::load_shared_quad(at_b.linear);
      pair.a.angular = exec::load_shared_quad(at_a.angular), pair.b.angular = exec::load_shared_quad(at_b.angular);
      if constexpr (moves_matter(what)) {
        pair.a.moved = exec::load_shared_quad(at_a.moved), pair.b.moved = exec::load_shared_quad(at_b.moved);
        pair.a.turned = exec::load_shared_quad(at_a.turned), pair.b.turned = exec::load_shared_quad(at_b.turned);
      }
      if (!cursor.by_data) break;
      bool ready = (!pair.pushes_a || is_due(pair.a.linear, pair.a.angular, pair.due_a)) &&
                   (!pair.pushes_b || is_due(pair.b.linear, pair.b.angular, pair.due_b));
      if (moves_matter(what) && cursor.moves > 0)
        ready = ready && (!pair.pushes_a || is_due(pair.a.moved, pair.a.turned, cursor.moves)) &&
                (!pair.pushes_b || is_due(pair.b.moved, pair.b.turned, cursor.moves));
      if (exec::all_ready(ready)) break;
    }
  }

  template <What what, class Inertia>
  FATHOM_HD_INLINED void sweep_with(Cursor cursor, std::uint32_t k, const Fetched& fetched) const {
    const ConstraintHead& head = fetched.head;
    const Quad masses = fetched.rows[mass_row];
    Pair pair;
    load_pair<what>(cursor, fetched, pair);
    ContactRows contact;
    load_contact(fetched.rows, static_cast<int>(head.bits & point_bits), contact);
    const bool from_zero = cursor.what == push_first;
    if (from_zero) contact.impulses = contact.impulses.cleared();
    RollRow roll;
    SurfaceEffect surface;
    if (head.has(row_extra)) roll = constraints.extras[k].roll, surface = {&constraints.extras[k].surface};
    const bool rolls = roll.length > 0;
    if (from_zero) roll.impulse = {};
    Quad* const rows = rows_of(constraints, k);
    ContactBodies<Inertia> both{contact_side<what, Inertia>(bodies, head.a, pair.a, masses.x, masses.y),
                                contact_side<what, Inertia>(bodies, head.b, pair.b, masses.z, masses.w)};
    if (what != warm && splits && cursor.split == SplitPhase::act) {
      split(both.a, splitting().parts(head.a)), split(both.b, splitting().parts(head.b));
      weigh(both, contact);
    }
    if constexpr (what == warm) {
      warm_start_contact<float>(contact, both);
      if (rolls) twist_apart(both, roll.impulse);
    } else if constexpr (what == bounce) {
      contact.bounce = constraints.bounces[k];
      const Bounce<float> bounced = bounce_contact(contact, both, p.h, p.restitution_threshold, surface);
      if (!bounced.any) return;
      contact.impulses.step += bounced.impulse;
      if (bounce_index(cursor) < noted_bounce_sweeps) exec::atomic_store(counters->bounced[bounce_index(cursor)], 1u);
    } else {
      sweep_contact<what>(head, contact, both, surface);
      if (rolls && (what == relax || !p.soft))
        roll.impulse = solve_rolling(both, roll.length, contact.impulses.sum(), roll.impulse);
    }
    ContactImpulses& impulses = contact.impulses;
    if (!is_sound(both, impulses)) {
      impulses = {};
      reload_velocity(head.a, both.a.linear, both.a.angular);
      reload_velocity(head.b, both.b.linear, both.b.angular);
    }
    if (splits && cursor.split == SplitPhase::count) {
      if (what != warm && (impulses.sum() > 0 || has_pushed(head, both))) count(head, pair);
      return;
    }
    store_pushed(cursor, head, pair, both);
    if constexpr (what == warm) return;
    store_normal_impulses(rows, impulses);
    if (what != bounce && rolls) constraints.extras[k].roll = roll;
    if (what != bounce && ends_substep(cursor)) impulses.step += impulses.sum();
    if (with_friction(what) || from_zero) store_friction_impulses(rows, impulses);
  }

  /// Sweeps points and friction, in the order of the pass.
  template <What what, class Inertia>
  FATHOM_HD_INLINED void sweep_contact(const ConstraintHead& head, ContactRows& contact, ContactBodies<Inertia>& both,
                                       SurfaceEffect surface) const {
    const bool fixed = head.bits & pushes_fixed_bit;
    const ContactAxes axes = contact.axes();
    const bool moves_as_told = fixed && !(both.a.linear == Vec3{} && both.a.angular == Vec3{});
    const CarriedBySides<Inertia> carried(surface, both, axes, moves_as_told, p.friction_lead);
    const ContactHold hold{p.soft ? head.held() : 0, push_share(head, both), head.jointed(), fixed};
    ContactStep step =
        soft_step(1 / p.h, p.contacts, p.push_out_velocity, hold, both.a.inverse_mass, both.b.inverse_mass);
    if (hold.held > 0) step.slop = support_slop(contact.frame.friction.patch_radius);
    // A sweep only tests whether it is above zero.
    contact.bounce.restitution = head.bits & bounces_bit ? 1.0f : 0.0f;
    if constexpr (what == relax)
      fathom::sweep_contact<ContactPass::relax, true>(contact, axes, both, step, carried);
    else if (p.soft)
      fathom::sweep_contact<ContactPass::soft, true>(contact, axes, both, step, carried);
    else
      fathom::sweep_contact<ContactPass::iterate, true>(contact, axes, both, step, carried);
  }

  /// `push_out_share`.
  template <class Inertia>
  FATHOM_HD float push_share(const ConstraintHead& head, const ContactBodies<Inertia>& both) const {
    if (!head.has(inertia_extra)) return 1;
    const float scale_a = head.bits & pushes_fixed_bit ? 1.0f : bodies.support[head.a].load.inertia_scale;
    return push_out_share(both.a.inverse_mass, scale_a, both.b.inverse_mass, bodies.support[head.b].load.inertia_scale,
                          p.push_out_velocity);
  }

  /// Warm starting comes before anything has moved.
  template <What what, class Inertia>
  FATHOM_HD static ContactBody<Inertia> contact_side(const auto& bodies, std::uint32_t i, const SolverQuads& quads,
                                                     float inverse_mass, float inverse_inertia) {
    ContactBody<Inertia> side{quads.linear.xyz(), quads.angular.xyz(), inverse_mass,
                              world_inertia<Inertia>(bodies, i, inverse_mass, inverse_inertia)};
    if constexpr (moves_matter(what)) side.moved = quads.moved.xyz(), side.turned = quads.turned.xyz();
    return side;
  }

  /// A separate function: inlined, it would cost the others registers.
  FATHOM_HD void sweep_generic(Cursor cursor, std::uint32_t k, const Fetched& f) const {
    const std::uint32_t slot = constraints.contact[k] & ~joint_tag;
    const GenericJoint& joint = generic_joints[slot];
    if (joint.couples != 0)
      sweep_joint(cursor, k, f, CouplingSweep(f.rows, joint, reactions[slot]));
    else
      sweep_joint(cursor, k, f, GenericJointSweep(f.rows, joint, reactions[slot]));
  }

  template <class Law>
  FATHOM_HD_INLINED void sweep_joint(Cursor cursor, std::uint32_t k, const Fetched& f, Law law) const {
    if (cursor.what == push || cursor.what == push_first)
      sweep_joint_as<push>(cursor, k, f, law);
    else if (cursor.what == relax)
      sweep_joint_as<relax>(cursor, k, f, law);
    else if (cursor.what == warm)
      sweep_joint_as<warm>(cursor, k, f, law);
  }
  template <What what, class Law>
  FATHOM_HD_INLINED void sweep_joint_as(Cursor cursor, std::uint32_t k, const Fetched& f, Law& law) const {
    if (Law::by_inertia && !(f.head.bits & anisotropic_bit))
      sweep_joint_with<what, float>(cursor, k, f, law);
    else
      sweep_joint_with<what, SymMat3>(cursor, k, f, law);
  }

  template <What what, class Inertia>
  FATHOM_HD static typename JointBodies<Inertia>::Side joint_side(const auto& bodies, std::uint32_t i,
                                                                  const SolverQuads& quads, float inverse_mass,
                                                                  float inverse_inertia) {
    typename JointBodies<Inertia>::Side side;
    side.linear = quads.linear.xyz(), side.angular = quads.angular.xyz();
    if constexpr (moves_matter(what)) side.moved = quads.moved.xyz(), side.turned = quads.turned.xyz();
    side.inverse_mass = inverse_mass;
    side.inverse_inertia = inverse_mass > 0 ? inverse_inertia : 1.0f;
    side.response = world_inertia<Inertia>(bodies, i, inverse_mass, inverse_inertia);
    return side;
  }

  template <What what, class Inertia, class Law>
  FATHOM_HD_INLINED void sweep_joint_with(Cursor cursor, std::uint32_t k, const Fetched& fetched, Law& law) const {
    const ConstraintHead& head = fetched.head;
    const Quad masses = fetched.rows[mass_row];
    if (cursor.what == push_first) law.begin_without_impulses();
    Pair pair;
    load_pair<what>(cursor, fetched, pair);
    JointBodies<Inertia> both{joint_side<what, Inertia>(bodies, head.a, pair.a, masses.x, masses.y),
                              joint_side<what, Inertia>(bodies, head.b, pair.b, masses.z, masses.w)};
    if (splits && cursor.split == SplitPhase::count) {
      if (what != warm) count(head, pair);
      return;
    }
    if (what != warm && splits && cursor.split == SplitPhase::act)
      split(both.a, splitting().parts(head.a)), split(both.b, splitting().parts(head.b));
    const bool ends = ends_substep(cursor);
    float sum;
    if constexpr (what == warm) {
      law.warm_start(both);
      const Vec3 all = (both.a.linear + both.a.angular) + (both.b.linear + both.b.angular);
      sum = all.x + (all.y + all.z);
    } else if constexpr (what == relax) {
      sum = law.template solve<JointPass::relax>(both, p.h, ends);
    } else if (p.soft) {
      sum = law.template solve<JointPass::soft>(both, p.h, ends);
    } else {
      sum = law.template solve<JointPass::iterate>(both, p.h, ends);
    }
    if (!is_finite(sum)) {
      law.forget();
      reload_velocity(head.a, both.a.linear, both.a.angular);
      reload_velocity(head.b, both.b.linear, both.b.angular);
    }
    store_pushed(cursor, head, pair, both);
    law.store(rows_of(constraints, k), ends);
  }

  /// Whether a sweep reads the bodies' movement.
  FATHOM_HD static constexpr bool moves_matter(What what) { return what == push || what == relax || what == bounce; }

  FATHOM_HD void reload_velocity(std::uint32_t i, Vec3& linear, Vec3& angular) const {
    linear = exec::load_shared_quad(bodies.solver[i].linear).xyz();
    angular = exec::load_shared_quad(bodies.solver[i].angular).xyz();
  }
  FATHOM_HD void store_velocity(std::uint32_t i, Vec3 linear, Vec3 angular, std::uint32_t writes) const {
    exec::store_shared_quad(bodies.solver[i].linear, written(linear, writes));
    exec::store_shared_quad(bodies.solver[i].angular, written(angular, writes));
  }

  /// Velocities first, because others wait for them.
  FATHOM_HD_INLINED void store_pushed(Cursor cursor, const ConstraintHead& head, const Pair& pair,
                                      const auto& both) const {
    if (splits && cursor.split == SplitPhase::act) {
      if (pair.pushes_b) splitting().add(head.b, both.b.linear, both.b.angular);
      if (pair.pushes_a) splitting().add(head.a, both.a.linear, both.a.angular);
      return;
    }
    if (pair.pushes_b) store_velocity(head.b, both.b.linear, both.b.angular, pair.due_b + 1);
    if (pair.pushes_a) store_velocity(head.a, both.a.linear, both.a.angular, pair.due_a + 1);
  }

  // Sweeps over the overflow.

  FATHOM_HD auto splitting() const { return MassSplitting<decltype(bodies)>{bodies}; }
  FATHOM_HD void count(const ConstraintHead& head, const Pair& pair) const {
    if (pair.pushes_a) splitting().count(head.a);
    if (pair.pushes_b) splitting().count(head.b);
  }
  /// Whether a sweep has changed the velocity of one of its bodies, which nothing has stored yet.
  FATHOM_HD bool has_pushed(const ConstraintHead& head, const auto& both) const {
    const auto is_new = [&](std::uint32_t i, const auto& side) {
      Vec3 linear, angular;
      reload_velocity(i, linear, angular);
      return !(linear == side.linear && angular == side.angular);
    };
    return is_new(head.a, both.a) || is_new(head.b, both.b);
  }

  /// Updates W.
  FATHOM_HD static void carry_on(WarmStart& w, Vec3 linear, Vec3 angular) {
    w.linear = carried(w.linear, linear, w.linear_reference);
    w.angular = carried(w.angular, angular, w.angular_reference);
  }

  /// Only a body's own work-item writes its data, except the velocities. `body`: contacts, contacts with a colour;
  /// `rows`: warm start, motion, movement, inverse inertia.
  FATHOM_HD_INLINED void fetch_body(Cursor cursor, std::uint32_t i, Fetched& f) const {
    f.body.touching = bodies.touching[i];
    if (f.body.touching == 0) return;
    if (cursor.by_data) f.body.colours = exec::bit_count(bodies.colours[i]);
    const BodyMotion motion = bodies.motion[i];
    f.rows[4] = quad(motion.acceleration, motion.linear_damping);
    f.rows[5] = quad(motion.angular_acceleration, motion.angular_damping);
    if (cursor.what == integrate_first_v) return;
    const WarmStart w = bodies.warm[i];
    f.rows[0] = quad(w.linear, 0), f.rows[1] = quad(w.angular, 0);
    f.rows[2] = quad(w.linear_reference, 0), f.rows[3] = quad(w.angular_reference, 0);
    if (cursor.what != integrate_x) return;
    f.rows[6] = bodies.solver[i].moved, f.rows[7] = bodies.solver[i].turned;
    f.rows[8].x = bodies.constants[i].inverse_inertia;
  }

  /// Loads the velocities of body i once they are due; returns their write count.
  FATHOM_HD_INLINED std::uint32_t load_velocity(Cursor cursor, std::uint32_t i, const Fetched& f, Vec3& linear,
                                                Vec3& angular) const {
    const std::uint32_t due = cursor.by_data ? cursor.integrations + cursor.sweeps * f.body.colours : 0;
    for (exec::Patience patience;; patience.look_again()) {
      const Quad l = exec::load_shared_quad(bodies.solver[i].linear);
      const Quad a = exec::load_shared_quad(bodies.solver[i].angular);
      linear = l.xyz(), angular = a.xyz();
      if (!cursor.by_data || exec::all_ready(is_due(l, a, due))) return due;
    }
  }

  FATHOM_HD static WarmStart warm_start_of(const Fetched& f) {
    WarmStart w;
    w.linear = f.rows[0].xyz(), w.angular = f.rows[1].xyz();
    w.linear_reference = f.rows[2].xyz(), w.angular_reference = f.rows[3].xyz();
    return w;
  }

  FATHOM_HD_INLINED void carry_impulses(std::uint32_t i, const Fetched& f) const {
    if (f.body.touching == 0 || f.rows[4].w == 0) return;
    WarmStart w = warm_start_of(f);
    carry_on(w, bodies.solver[i].linear.xyz(), bodies.solver[i].angular.xyz());
    bodies.warm[i] = w;
  }

  FATHOM_HD_INLINED void integrate_velocity(Cursor cursor, std::uint32_t i, const Fetched& f, bool carried) const {
    const float linear_damping = f.rows[4].w, angular_damping = f.rows[5].w;
    if (f.body.touching == 0 || linear_damping == 0) return;  // zero damping factor: it cannot be pushed
    const bool first = cursor.what == integrate_first_v;
    Vec3 linear, angular;
    const std::uint32_t due = load_velocity(cursor, i, f, linear, angular);
    if (cursor.substep > 0) fail_on_request(SolverStage::relaxes, cursor, i, linear, angular);
    WarmStart w;
    if (!first) {
      w = warm_start_of(f);
      if (!carried) carry_on(w, linear, angular);
    }
    linear = w.linear_reference = substep_velocity(linear, f.rows[4].xyz(), linear_damping, p.h, w.linear);
    angular = w.angular_reference = substep_velocity(angular, f.rows[5].xyz(), angular_damping, p.h, w.angular);
    fail_on_request(SolverStage::velocities, cursor, i, linear, angular);
    store_velocity(i, linear, angular, due + 1);
    bodies.warm[i] = w;
  }

  FATHOM_HD_INLINED void integrate_position(const Plan& plan, Cursor cursor, std::uint32_t i, const Fetched& f) const {
    if (f.body.touching == 0 || f.rows[4].w == 0) return move_unpushed(plan, i);
    Vec3 linear, angular;
    const std::uint32_t due = load_velocity(cursor, i, f, linear, angular);
    fail_on_request(SolverStage::pushes, cursor, i, linear, angular);
    const bool is_pushed = !(linear == f.rows[2].xyz() && f.rows[0].xyz() == Vec3{});
    const bool is_slowed_down = slow_down(linear, angular, bodies.warm[i], p.limits);
    const Vec3 mean = is_pushed || is_slowed_down ? linear : mean_velocity(linear, f.rows[4].xyz(), p.h);
    const Vec3 moved = mul_add(f.rows[6].xyz(), p.h, mean);
    Vec3 turned = f.rows[7].xyz();
    if (f.rows[8].x == 0) {
      const BodyTensors t = bodies.tensors[i];
      const Quat start = bodies.poses[i].rotation;
      const Vec3 by =
          spin_in_contact(bodies.inertia[i].rotation, start, angular, bodies.warm[i], t.inertia, t.inverse, p.h);
      turned = kinds != JointKinds::absent && bodies.joint_colours[i] != 0
                   ? turned_so_far(bodies.inertia[i].rotation, start, turned_further(turned, by))
                   : turned + by;
    } else {
      turned = mul_add(turned, p.h, angular);
    }
    fail_on_request(SolverStage::positions, cursor, i, linear, angular);
    if (!is_finite(linear) || !is_finite(angular) || !is_finite(moved) || !is_finite(turned)) isolate(i);
    // Without write counts, inverse mass and inertia stay.
    const bool counts = cursor.by_data;
    exec::store_shared_quad(bodies.solver[i].moved,
                            counts ? written(moved, cursor.moves + 1) : quad(moved, f.rows[6].w));
    exec::store_shared_quad(bodies.solver[i].turned,
                            counts ? written(turned, cursor.moves + 1) : quad(turned, f.rows[7].w));
    store_velocity(i, linear, angular, due + 1);
  }

  /// A body whose state is not finite stays at its pose at the start of the step, as a fixed obstacle. The step stops,
  /// to be solved again from there. No contact carries NaN or infinity to another body (`is_sound`), and sweeps create
  /// none, so failed bodies are found when they are moved.
  FATHOM_HD void isolate(std::uint32_t i) const {
    std::uint32_t& flags = bodies.flags[i];
    if (flags & isolated_flag) return;  // found in an earlier substep
    flags = (flags & ~static_cast<std::uint32_t>(awake_flag | forced_flag)) | isolated_flag;
    bodies.forces[i] = {};
    bodies.velocities[i] = Velocity{};
    bodies.poses[i].reserved = 0;
    bodies.isolated_in[i] = counters->step + 1;
    exec::atomic_add(counters->quarantined, 1u);
    exec::atomic_store(counters->any_isolated, 1u);
    exec::atomic_store(counters->layout_dirty, 1u);
    exec::atomic_store(counters->stopped, static_cast<std::uint32_t>(body_failed));
  }

  /// For tests. Faults of sweeps are applied before the body's next integration.
  FATHOM_HD void fail_on_request(SolverStage stage, Cursor cursor, std::uint32_t i, Vec3& linear, Vec3& angular) const {
    const std::uint32_t substep = stage == SolverStage::relaxes ? cursor.substep - 1 : cursor.substep;
    fathom::fail_on_request(stage, substep, bodies.filters[i].category, linear, angular);
  }

  /// Moves a kinematic body, or one that no impulse moves. Sleeping ones do not move.
  FATHOM_HD void move_unpushed(const Plan& plan, std::uint32_t i) const {
    if (!plan.any_kinematic) return;
    if (bodies.touching[i] == 0 && bodies.constants[i].motion() != MotionType::kinematic) return;
    SolverQuads& body = bodies.solver[i];
    const Vec3 v = limited(body.linear.xyz(), p.limits.linear), w = limited(body.angular.xyz(), p.limits.angular);
    body.moved = quad(mul_add(body.moved.xyz(), p.h, v), body.moved.w);
    body.turned = quad(mul_add(body.turned.xyz(), p.h, w), body.turned.w);
  }
};

}  // namespace fathom::device
