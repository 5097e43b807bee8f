// Sweeps over constraints partitioned into cells: one launch per cell group, in which a work-group solves the
// constraints of one part batch by batch, with barriers in between (dissertation, figure 3.10). Constraints and bodies
// are processed as in solve.hpp.
#pragma once

#include "device/published/cells.hpp"
#include "device/solve.hpp"
#include "exec/device.hpp"

namespace fathom::device {

/// The partition `cells` is for contacts only.
using SolveContacts = SolveConstraints<JointKinds::absent>;

/// Bodies' integrations, one launch each.
template <SolveContacts::What what>
struct IntegrateBodies {
  SolveContacts solver;
  bool bounces;

  FATHOM_HD void operator()(std::uint32_t i) const {
    SolveContacts::Plan plan{};
    plan.bounces = bounces;
    plan.any_kinematic = true;  // possibly: each body is checked
    const SolveContacts::Cursor cursor{what, 0, 0, 0};
    SolveContacts::Fetched fetched;
    solver.fetch(plan, cursor, i, fetched);
    solver(plan, cursor, i, fetched);
  }
};

/// Without warm starting every substep begins without impulses.
struct ClearImpulses {
  Constraints<constraint_rows> constraints;

  FATHOM_HD void operator()(std::uint32_t k) const {
    Quad* const rows = rows_of(constraints, k);
    const float step = rows[(impulse_row + 1) * tile_width].w;
    store_normal_impulses(rows, {});
    store_friction_impulses(rows, {.step = step});
    if (constraints.heads[k].has(row_extra)) constraints.extras[k].roll.impulse = {};
  }
};

template <SolveContacts::What what>
struct SolveCells {
  static constexpr std::uint32_t group_size = max_work_items;
  struct Local {};

  SolveContacts solver;
  Cells<> cells;
  std::uint32_t cell_group;
  std::uint32_t round;  ///< as in SolveContacts::Cursor; for bounce sweeps, the number of the sweep in the step

  FATHOM_HD void operator()(auto group, Local&) const {
    const std::uint32_t list = cell_group * cells.counters->work_groups + group.index();
    const std::uint32_t n = cells.used[list], batches = cells.batches[list], first = cells.firsts[list];
    if (n == 0) return;
    auto mine = per_item<CellSlot>(group);
    group.for_each(n, [&](std::uint32_t item) { mine[item] = cells.slots[first + item]; });
    for (std::uint32_t batch = 0; batch < batches; ++batch)
      group.for_each(n, [&](std::uint32_t item) {
        if (mine[item].batch == batch) sweep(mine[item].constraint);
      });
  }

 private:
  FATHOM_HD void sweep(std::uint32_t constraint) const {
    SolveContacts::Plan plan;
    plan.overflow = 0;
    plan.by_data = false;
    plan.schedule[0] = {0, 0};
    SolveContacts::Cursor cursor{what, 0, round, 0};
    if constexpr (what == SolveContacts::What::bounce)
      cursor.substep = round / max_bounce_sweeps, cursor.bounce_sweeps = round % max_bounce_sweeps;
    SolveContacts::Fetched fetched;
    solver.fetch(plan, cursor, constraint, fetched);
    solver(plan, cursor, constraint, fetched);
  }
};

/// All substeps (figure 3.9), over cell groups instead of colours.
template <exec::Device D>
void submit_cell_substeps(D& device, const SolveContacts& solver, const Cells<>& cells, bool warm_start, bool bounces,
                          exec::Range bodies, exec::Range constraints, exec::Range work_groups) {
  using What = SolveContacts::What;
  const auto sweep = [&]<What what>(std::integral_constant<What, what>, std::uint32_t round) {
    for (std::uint32_t g = 0; g < cell_groups; ++g)
      device.parallel_groups(work_groups, SolveCells<what>{solver, cells, g, round});
  };
  const SolveParameters& p = solver.p;
  for (std::uint32_t substep = 0; substep < p.substeps; ++substep) {
    if (bounces) {
      if (substep > 0) device.parallel_for(bodies, IntegrateBodies<What::carry>{solver, bounces});
      for (std::uint32_t k = 0; k < max_bounce_sweeps; ++k)
        sweep(std::integral_constant<What, What::bounce>{}, substep * max_bounce_sweeps + k);
    }
    if (substep == 0 || !warm_start)
      device.parallel_for(bodies, IntegrateBodies<What::integrate_first_v>{solver, bounces});
    else
      device.parallel_for(bodies, IntegrateBodies<What::integrate_v>{solver, bounces});
    if (!warm_start)
      device.parallel_for(constraints, ClearImpulses{solver.constraints});
    else if (substep == 0)
      sweep(std::integral_constant<What, What::warm>{}, 0);
    for (std::uint32_t k = 1; k <= p.sweeps_before; ++k) sweep(std::integral_constant<What, What::push>{}, k);
    device.parallel_for(bodies, IntegrateBodies<What::integrate_x>{solver, bounces});
    for (std::uint32_t k = 1; k <= p.sweeps_after; ++k)
      sweep(std::integral_constant<What, What::relax>{}, p.sweeps_before + 1 + k);
  }
}

}  // namespace fathom::device
