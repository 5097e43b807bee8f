// solve, if something is solved directly or there is an overflow: like SolveConstraints, with mechanisms after every
// sweep (dynamics/mechanism.hpp), and supports after every relax sweep (dynamics/support.hpp).
//
// A separate kernel: other worlds must not pay for its registers. Only one of the two kernels has phases in a step.
#pragma once

#include "device/mechanisms.hpp"
#include "device/solve.hpp"
#include "device/support_rows.hpp"

namespace fathom::device {

/// The supports of a body, with the interface that `ask_supports` expects.
struct SupportsOfBody {
  const SolvedConstraints& constraints;
  const std::uint32_t* contacts;
  std::uint32_t supports;

  FATHOM_HD int count() const { return static_cast<int>(supports); }
  FATHOM_HD SupportRows rows(int j) const {
    const std::uint32_t k = contacts[j];
    const SupportRecord& record = constraints.supports[k];
    SupportRows r = load_support(constraints, k, record.upper == upper_b);
    for (int p = 0; p < max_manifold_points; ++p) r.weight[p] = record.weight[p];
    r.slide_weight = record.slide_weight, r.max_load = record.max_load;
    return r;
  }
  FATHOM_HD ContactImpulses impulses(int j) const { return load_impulses(constraints, contacts[j]); }
  FATHOM_HD SupportChange& change(int j) const { return constraints.supports[contacts[j]].change; }
};

// Outside the kernel's template, because nvcc 13 cannot compile these inside it.
FATHOM_HD std::uint32_t bits_of(float x) { return __builtin_bit_cast(std::uint32_t, x); }
FATHOM_HD float power_of_two(int exponent) {
  return __builtin_bit_cast(float, static_cast<std::uint32_t>(127 + exponent) << 23);
}

/// Mechanisms take one phase, with one team each. A direct solution of supports takes one phase per level, from the top
/// down, in which bodies ask their supports; one that sums up the effect of all; and one in which each structure goes
/// its part of the way. All work-items wait for all others before and after, except between the levels of towers, which
/// belong to one warp. Between sweeps they wait only for data, where that is possible.
template <JointKinds kinds>
struct SolveDirectly {
  using Solver = SolveConstraints<kinds, true>;
  // Seven warps, and on CUDA an eighth that signals their arrival: a ninth would leave each a third fewer registers.
  static constexpr std::uint32_t group_size = 224;
  static constexpr bool wants_registers = true;
  static constexpr std::uint32_t plan_parts = level_slots;
  struct Plan : Solver::Plan {
    std::uint32_t supported;
    bool in_one_warp;  ///< each level fits in one warp
    Stretch level[level_slots];
  };
  using Fetched = typename Solver::Fetched;
  enum Stage : std::uint32_t { sweeps, linked, asking, summing, moving };
  struct Cursor {
    typename Solver::Cursor in_solve;
    Stage stage;
    std::uint32_t level;
    bool follows_solution;
  };

  Solver solver;
  Joints<> joints;
  Mechanisms<mechanism_states> mechanisms;

  /// Number of phases of the direct solutions of a step.
  FATHOM_HD static std::uint32_t support_phases(const SolveParameters& p, std::uint32_t levels) {
    return p.substeps * p.sweeps_after * (levels + 2);
  }
  FATHOM_HD static std::uint32_t mechanism_phases(const SolveParameters& p) {
    return (p.warm_start ? 1 : 0) + p.substeps * (p.sweeps_before + p.sweeps_after);
  }

  FATHOM_HD void plan_part(Plan& plan, std::uint32_t k) const {
    static_assert(Solver::plan_parts <= plan_parts);
    if (k < Solver::plan_parts) solver.plan_part(plan, k);
    plan.level[k] = solver.counters->level[k];
    if (k > 0) return;
    plan.supported = solver.counters->supported;
    plan.in_one_warp = !solver.counters->has_wide_level;
  }
  FATHOM_HD void keep_barriers(Plan& plan) const { solver.keep_barriers(plan); }
  FATHOM_HD std::uint32_t phases(const Plan& plan) const {
    const std::uint32_t n = solver.all_phases(plan);
    if (n == 0 || !plan.any_direct()) return 0;
    return n + (plan.support_levels ? support_phases(solver.p, plan.support_levels) : 0) +
           (plan.mechanisms ? mechanism_phases(solver.p) : 0);
  }
  FATHOM_HD Cursor cursor_at(const Plan& plan, std::uint32_t phase) const {
    Cursor cursor{solver.cursor_at(plan, 0), sweeps, 0, false};
    for (std::uint32_t k = 0; k < phase; ++k) cursor = next(plan, cursor);
    return cursor;
  }
  FATHOM_HD Cursor next(const Plan& plan, Cursor cursor) const {
    const typename Solver::Cursor& at = cursor.in_solve;
    const bool ends_sweep = cursor.stage == sweeps && Solver::is_sweep(at) && Solver::ends_sweep(at);
    if (plan.mechanisms && ends_sweep && at.what != Solver::bounce) return {at, linked, 0, false};
    if (plan.support_levels && at.what == Solver::relax && (ends_sweep || cursor.stage == linked))
      return {at, asking, plan.support_levels, false};
    if (cursor.stage == asking && cursor.level > 1) return {at, asking, cursor.level - 1, false};
    if (cursor.stage == asking) return {at, summing, 0, false};
    if (cursor.stage == summing) return {at, moving, 0, false};
    return {solver.next(plan, at), sweeps, 0, cursor.stage != sweeps};
  }
  FATHOM_HD std::uint32_t items(const Plan& plan, Cursor cursor) const {
    if (cursor.stage == sweeps) return solver.items(plan, cursor.in_solve);
    if (cursor.stage == linked) return plan.mechanisms * team::items;
    return cursor.stage == asking ? plan.level[cursor.level].count : plan.supported;
  }
  FATHOM_HD bool may_exceed_launch(const Plan&, Cursor cursor) const {
    return cursor.stage == sweeps && Solver::is_overflow(cursor.in_solve);
  }
  FATHOM_HD exec::Wait wait_before(const Plan& plan, Cursor cursor) const {
    if (cursor.stage == asking && cursor.level < plan.support_levels && plan.in_one_warp) return exec::Wait::for_warp;
    const bool by_data = plan.by_data && cursor.stage == sweeps && !cursor.follows_solution;
    return by_data ? exec::Wait::for_data : exec::Wait::for_all;
  }
  FATHOM_HD void fetch(const Plan& plan, Cursor cursor, std::uint32_t i, Fetched& f) const {
    if (cursor.stage == sweeps) solver.fetch(plan, cursor.in_solve, i, f);
  }
  FATHOM_HD void operator()(const Plan& plan, Cursor cursor, std::uint32_t k, const Fetched& fetched) const {
    if (cursor.stage == sweeps) return solver(plan, cursor.in_solve, k, fetched);
    if (cursor.stage == linked) return solve_mechanism(cursor.in_solve, k / team::items);
    const std::uint32_t i = bodies().by_level[plan.level[cursor.level].first + k];
    if (cursor.stage == moving && k == 0) solver.counters->solved_step = solver.counters->step + 1;
    const SupportNode& node = bodies().nodes[i];
    const std::uint32_t parity = cursor.in_solve.substep % 2;
    Structure& structure = bodies().structures[bodies().support[i].structure];
    if (!node.is_held()) {
      if (cursor.stage == moving) bodies().nodes[i].held = 0;
    } else if (cursor.stage == asking) {
      ask(i, node, structure, parity);
    } else if (cursor.stage == summing) {
      add_up(bodies().moves[i], structure, parity);
    } else {
      move(i, node, structure, parity);
    }
  }

 private:
  FATHOM_HD const auto& bodies() const { return solver.bodies; }
  FATHOM_HD const auto& constraints() const { return solver.constraints; }

  /// The direct solution of a mechanism after a sweep, or of all mechanisms of its cluster.
  FATHOM_HD void solve_mechanism(const typename Solver::Cursor& at, std::uint32_t number) const {
    const std::uint32_t leader = mechanisms.records[number].leader;
    const bool is_alone = leader == none || !mechanisms.records[leader].has_small_cluster();
    if (!is_alone && leader != number) return;
    for (std::uint32_t next = number; next != none;) {
      solve_mechanism_alone(at, next);
      next = is_alone ? none : next_of_cluster(mechanisms.records[leader], next);
    }
  }
  /// The one with the next larger number.
  FATHOM_HD static std::uint32_t next_of_cluster(const MechanismRecord& leader, std::uint32_t number) {
    std::uint32_t next = none;
    for (std::uint32_t n = 0; n < leader.cluster_size; ++n)
      if (leader.cluster[n] > number && leader.cluster[n] < next) next = leader.cluster[n];
    return next;
  }
  FATHOM_HD void solve_mechanism_alone(const typename Solver::Cursor& at, std::uint32_t number) const {
    if constexpr (kinds != JointKinds::absent) {
      const MechanismRecord& record = mechanisms.records[number];
      if (!record.is_direct()) return;
      const auto direct = direct_solver(bodies(), joints, mechanisms, constraints(), solver.p);
      const float h = solver.p.h;
      if (at.what == Solver::relax) {
        if (solver.has_just_moved(at)) move_by_means(direct, record.tree);
        return direct.relax(record.tree, h);
      }
      if (at.what == Solver::warm && direct.warm_start(record.tree, h, false)) return;
      if (at.what == Solver::push_first) direct.warm_start(record.tree, h, true);
      direct.pull_together(record.tree, h);
    }
  }

  FATHOM_HD void move_by_means(const auto& direct, const Mechanism& tree) const {
    for (std::uint32_t i = tree.first + team::item(); i < tree.end; i += team::items)
      direct.access.move_by_mean(direct.links[i], solver.p.h);
    team::sync();
  }

  /// The wrench that upper bodies take from body i, about its centre. Each has stored it with its contact, so sums do
  /// not depend on the order of items.
  FATHOM_HD Wrench passed_on(const SupportNode& node) const {
    Wrench sum;
    for (std::uint32_t j = node.supports; j < node.contacts; ++j) {
      const std::uint32_t k = constraints().contacts_of[node.first + j];
      if (k == none) continue;
      const SupportRecord& record = constraints().supports[k];
      if (record.upper == no_upper) continue;
      const ContactArms arms = load_arms(constraints(), k);
      sum += about_centre(record.wrench, record.upper == upper_b ? arms.a : arms.b);
    }
    return sum;
  }

  /// The structure's common motion along the chord of the step's path: along a tangent a stack on a turntable would
  /// drift outwards.
  FATHOM_HD Velocity motion_along_chord(const Structure& structure, std::uint32_t i) const {
    Velocity common = common_motion(bodies(), structure, i);
    if (!structure.has_moving_base()) return common;
    const Vec3 arm = bodies().poses[i].position - bodies().poses[structure.first_base].position;
    const float half_step = 0.5f * solver.p.h * static_cast<float>(solver.p.substeps);
    common.linear += carried_speed<float>(arm, half_step * common.angular, common.angular);
    return common;
  }

  FATHOM_HD void ask(std::uint32_t i, const SupportNode& node, Structure& structure, std::uint32_t parity) const {
    const SupportMass mass(bodies(), *solver.counters, i);
    const SolverQuads& at = bodies().solver[i];
    const Velocity common = motion_along_chord(structure, i);
    const Vec3 linear = at.linear.xyz() - common.linear, angular = at.angular.xyz() - common.angular;
    const Wrench passed = passed_on(node);
    const Wrench excess = mass.momentum(linear, angular);
    Wrench demand = -excess;
    demand += passed;
    const SupportsOfBody supports{constraints(), constraints().contacts_of + node.first, node.supports};
    Wrench change = ask_supports(supports, node.factor, demand);
    for (int j = 0; j < supports.count(); ++j)
      constraints().supports[supports.contacts[j]].wrench = wrench_of(supports.rows(j), supports.change(j));
    change += -passed;
    SupportMove m;
    m.linear = mass.inverse_mass * change.force;
    m.angular = mass.spin(change.torque);
    m.slope = dot(linear, change.force) + dot(angular, change.torque);
    m.curvature = dot(m.linear, change.force) + dot(m.angular, change.torque);
    const float fall = length(solver.counters->gravity) * solver.p.h;
    m.energy = dot(linear, excess.force) + dot(angular, excess.torque);
    m.reference = fall * fall / mass.inverse_mass;
    bodies().moves[i] = m;
    // Nonnegative floats have the order of their bits; NaN comes last.
    const float sizes = max(max(abs(m.slope), abs(m.curvature)), max(m.energy, m.reference));
    exec::atomic_max(structure.largest, bits_of(sizes) & 0x7fffffffu);
    exec::atomic_max(structure.largest, bits_of(m.slope + m.curvature + m.energy) & 0x7fffffffu);
    const float calm = calm_part(m.energy, m.slope, m.curvature, 1.0f / mass.inverse_mass);
    if (calm < 1) exec::atomic_max(structure.held_back[parity], bits_of(1 - calm));
  }

  /// Sums terms in units of a power of two: the largest one fills 36 bits.
  FATHOM_HD static void add_up(const SupportMove& m, Structure& structure, std::uint32_t parity) {
    constexpr std::uint32_t infinity = 255, least = 40;
    const std::uint32_t largest = structure.largest >> 23, exponent = largest < least ? least : largest;
    std::int64_t slope = 1, curvature = 1, energy = 1, reference = 1;  // if not finite: nothing moves
    if (exponent < infinity) {
      const float scale = power_of_two(127 + 35 - static_cast<int>(exponent));
      slope = static_cast<std::int64_t>(scale * m.slope);
      curvature = static_cast<std::int64_t>(scale * m.curvature);
      energy = static_cast<std::int64_t>(scale * m.energy);
      reference = static_cast<std::int64_t>(scale * m.reference);
    }
    exec::atomic_add(structure.slope[parity], static_cast<std::uint64_t>(slope));
    exec::atomic_add(structure.curvature[parity], static_cast<std::uint64_t>(curvature));
    exec::atomic_add(structure.excess[parity], static_cast<std::uint64_t>(energy));
    exec::atomic_add(structure.reference[parity], static_cast<std::uint64_t>(reference));
  }

  FATHOM_HD void move(std::uint32_t i, const SupportNode& node, Structure& structure, std::uint32_t parity) const {
    const auto sum = [](std::uint64_t terms) { return static_cast<float>(static_cast<std::int64_t>(terms)); };
    const float slope = sum(structure.slope[parity]), curvature = sum(structure.curvature[parity]);
    const float calm = 1 - __builtin_bit_cast(float, structure.held_back[parity]);
    const float part = min(best_part(slope, curvature), calm);
    const float energy = sum(structure.excess[parity]);
    // Reset for the next solution. All bodies of a structure store the same.
    exec::atomic_store(structure.largest, 0u);
    structure.slope[1 - parity] = structure.curvature[1 - parity] = 0;
    structure.excess[1 - parity] = structure.reference[1 - parity] = 0;
    structure.held_back[1 - parity] = 0;
    bodies().nodes[i].held =
        part_held(energy_left(part, slope, curvature, energy), sum(structure.reference[parity]), 1);
    if (!is_worth_making(part, slope, curvature, energy)) return;
    const SupportMove& m = bodies().moves[i];
    SolverQuads& to = bodies().solver[i];
    // The write count stays unchanged: no work-item waits for the quads now.
    to.linear = quad(mul_add(to.linear.xyz(), part, m.linear), to.linear.w);
    to.angular = quad(mul_add(to.angular.xyz(), part, m.angular), to.angular.w);
    const SupportsOfBody supports{constraints(), constraints().contacts_of + node.first, node.supports};
    for (int j = 0; j < supports.count(); ++j) {
      ContactImpulses impulses = supports.impulses(j);
      apply_change(supports.rows(j), supports.change(j), part, impulses);
      Quad* const rows = rows_of(constraints(), supports.contacts[j]);
      store_normal_impulses(rows, impulses);
      store_friction_impulses(rows, impulses);
    }
  }
};

}  // namespace fathom::device
