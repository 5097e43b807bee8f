// solve, where there are columns: as SolveConstraints, and columns are braced after every sweep (dynamics/columns.hpp).
//
// A kernel of its own, so that worlds without columns do not carry its registers. Of the two the one that is not due
// has no phases.
#pragma once

#include "device/solve.hpp"
#include "dynamics/columns.hpp"

namespace fathom::device {

/// A column's constraints and bodies, as ColumnBrace wants them.
struct ColumnView {
  const BodyArrays& bodies;
  const ConstraintArrays& constraints;
  const SolveParameters& p;
  const ColumnContact* contacts;  ///< of the column, from its base

  FATHOM_HD void load(std::uint32_t k, ColumnContactState& s) const {
    const Quad* const rows = rows_of(constraints, contacts[k].constraint);
    Quad q[row_count];
    for (std::uint32_t r = 0; r < row_count; ++r) q[r] = rows[r * tile_width];
    s.frame = frame_of(q);
    s.impulses = impulses_of(q);
    s.count = static_cast<int>(constraints.heads[contacts[k].constraint].bits & point_bits);
    for (std::uint32_t i = 0; i < max_manifold_points; ++i) {
      const Quad& point = q[first_point_row + i];
      s.points[i] = {point.x, point.y, point.z, point.w};
    }
    s.up = contacts[k].upward ? 1.0f : -1.0f;
  }
  FATHOM_HD void set_impulses(std::uint32_t k, const ContactImpulses& impulses) const {
    Quad* const rows = rows_of(constraints, contacts[k].constraint);
    store_normal_impulses(rows, impulses);
    store_friction_impulses(rows, impulses);
  }
  FATHOM_HD ContactStep step(std::uint32_t k) const {
    const bool fixed = constraints.heads[contacts[k].constraint].bits & pushes_fixed_bit;
    return {1.0f / p.h, fixed ? p.contacts.fixed : p.contacts.dynamic, p.push_out_velocity, false};
  }

  FATHOM_HD std::uint32_t index(std::uint32_t j) const {
    const ColumnContact c = contacts[j == 0 ? 0 : j - 1];
    const ConstraintHead& pair = constraints.heads[c.constraint];
    return (j > 0) == static_cast<bool>(c.upward) ? pair.b : pair.a;
  }
  FATHOM_HD SolverBody body(std::uint32_t j) const { return bodies.solver[index(j)].body(); }
  FATHOM_HD Vec3 acceleration(std::uint32_t j) const { return bodies.motion[index(j)].acceleration; }
  FATHOM_HD Mat3 inertia(std::uint32_t j) const {
    const std::uint32_t i = index(j);
    const float inverse = bodies.solver[i].turned.w;
    if (inverse > 0) return column_inertia(inverse, {});
    const WorldInertia w = bodies.inertia[i];
    return column_inertia(0, {w.xx, w.yy, w.zz, w.xy, w.xz, w.yz});
  }
  FATHOM_HD void set_velocity(std::uint32_t j, Vec3 linear, Vec3 angular) const {
    SolverQuads& body = bodies.solver[index(j)];
    body.linear = quad(linear, 0);
    body.angular = quad(angular, 0);
  }
};

struct SolveWithColumns {
  // Seven warps, and on CUDA an eighth that tells of their arrival: a ninth would leave each a third fewer registers.
  static constexpr std::uint32_t group_size = 224;
  static constexpr bool wants_registers = true;
  static constexpr std::uint32_t plan_parts = SolveConstraints::plan_parts;
  using Plan = SolveConstraints::Plan;
  using Fetched = SolveConstraints::Fetched;
  struct Place {
    SolveConstraints::Place in_solve;
    bool braces;  ///< the columns, after the sweep of `in_solve`
  };

  SolveConstraints solver;

  FATHOM_HD void plan_part(Plan& plan, std::uint32_t k) const { solver.plan_part(plan, k); }
  FATHOM_HD std::uint32_t phases(const Plan& plan) const {
    const std::uint32_t n = solver.all_phases(plan);
    return n && plan.columns ? n + 2 * solver.p.substeps : 0;
  }
  FATHOM_HD Place place(const Plan& plan, std::uint32_t phase) const {
    Place place{solver.place(plan, 0), false};
    for (std::uint32_t k = 0; k < phase; ++k) place = next(plan, place);
    return place;
  }
  FATHOM_HD Place next(const Plan& plan, Place place) const {
    const SolveConstraints::Place& at = place.in_solve;
    if (!place.braces && is_braced(at.what) && at.colour + 1 == plan.sweeps) return {at, true};
    return {solver.next(plan, at), false};
  }
  FATHOM_HD std::uint32_t items(const Plan& plan, Place place) const {
    return place.braces ? plan.columns : solver.items(plan, place.in_solve);
  }
  FATHOM_HD bool is_serial(const Plan& plan, Place place) const {
    return !place.braces && solver.is_serial(plan, place.in_solve);
  }
  FATHOM_HD void fetch(const Plan& plan, Place place, std::uint32_t i, Fetched& f) const {
    if (!place.braces) solver.fetch(plan, place.in_solve, i, f);
  }
  FATHOM_HD void operator()(const Plan& plan, Place place, std::uint32_t i, const Fetched& fetched) const {
    if (place.braces) {
      const ColumnRange range = solver.bodies.calm_columns[i];
      const ColumnView column{solver.bodies, solver.constraints, solver.p, solver.bodies.column_contacts + range.first};
      ColumnBrace<ColumnView>(column, range.count, place.in_solve.what != SolveConstraints::relax)();
    } else {
      solver(plan, place.in_solve, i, fetched);
    }
  }

 private:
  FATHOM_HD static bool is_braced(SolveConstraints::What what) {
    return what == SolveConstraints::push || what == SolveConstraints::push_first || what == SolveConstraints::relax;
  }
};

}  // namespace fathom::device
