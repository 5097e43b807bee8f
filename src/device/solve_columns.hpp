// solve, where there are columns: as SolveConstraints, and columns are braced after every sweep (dynamics/columns.hpp).
//
// A kernel of its own, so that worlds without columns do not carry its registers. Of the two the one that is not due
// has no phases.
#pragma once

#include "device/solve.hpp"
#include "dynamics/columns.hpp"

namespace fathom::device {

/// A column's constraints and bodies.
struct ColumnView {
  const BodyArrays& bodies;
  const ConstraintArrays& constraints;
  const SolveParameters& p;
  const ColumnContact* contacts;  ///< of the column, from its base

  FATHOM_HD Quad* rows(std::uint32_t k) const { return rows_of(constraints, contacts[k].constraint); }

  FATHOM_HD void load(std::uint32_t k, ColumnContactState& s) const {
    const Quad* const from = rows(k);
    Quad q[row_count];
    for (std::uint32_t r = 0; r < row_count; ++r) q[r] = from[r * tile_width];
    s.frame = frame_of(q);
    s.impulses = impulses_of(q);
    s.count = static_cast<int>(constraints.heads[contacts[k].constraint].bits & point_bits);
    for (std::uint32_t i = 0; i < max_manifold_points; ++i) {
      const Quad& point = q[first_point_row + i];
      s.points[i] = {point.x, point.y, point.z, point.w};
    }
    s.up = contacts[k].upward ? 1.0f : -1.0f;
  }
  FATHOM_HD ContactStep step(std::uint32_t k) const {
    const bool fixed = constraints.heads[contacts[k].constraint].bits & pushes_fixed_bit;
    return {1.0f / p.h, fixed ? p.contacts.fixed : p.contacts.dynamic, p.push_out_velocity, false};
  }

  /// The device index of body j.
  FATHOM_HD std::uint32_t index(std::uint32_t j) const { return j == 0 ? contacts[0].below : contacts[j - 1].above; }
  FATHOM_HD SolverBody body(std::uint32_t j) const { return bodies.solver[index(j)].body(); }
  FATHOM_HD Vec3 acceleration(std::uint32_t j) const { return bodies.motion[index(j)].acceleration; }
  FATHOM_HD Mat3 inertia(std::uint32_t j, float inverse) const {
    if (inverse > 0) return column_inertia(inverse, {});
    const WorldInertia w = bodies.inertia[index(j)];
    return column_inertia(0, {w.xx, w.yy, w.zz, w.xy, w.xz, w.yz});
  }
  FATHOM_HD void set_velocity(std::uint32_t j, Vec3 linear, Vec3 angular) const {
    SolverQuads& body = bodies.solver[index(j)];
    body.linear = quad(linear, 0);
    body.angular = quad(angular, 0);
  }
};

/// What a contact's two bodies and impulses change by. In memory it takes the place of those parts of a rung that the
/// walks alone read.
struct ColumnChange {
  Vec3 target;  ///< m/s, of the upper body
  float part;   ///< of the change that is made; 0: none
  ColumnGain gain;
  Vec3 spin;         ///< rad/s
  Vec3 base_target;  ///< of the lower body, if
  bool moves_base;
};

/// A column's rungs in memory. How often the walks wait for memory is what a brace takes, so each rung is one stretch.
struct StoredRungs {
  const ColumnView& column;
  Quad* quads;  ///< of the column

  FATHOM_HD Quad* at(std::uint32_t k) const { return quads + std::size_t{k} * rung_quads; }

  FATHOM_HD void put(std::uint32_t k, const ColumnRung& r) const {
    Quad* const q = at(k);
    const std::uint32_t bits = r.touches | (r.holds ? holds_bit : 0);
    q[0] = quad(r.n, r.up);
    q[1] = quad(r.t1, r.friction);
    q[2] = {r.x[0], r.x[1], r.x[2], r.x[3]};
    q[3] = {r.y[0], r.y[1], r.y[2], r.y[3]};
    const ContactImpulses& p = r.impulses;
    q[4] = {p.normal[0], p.normal[1], p.normal[2], p.normal[3]};
    q[5] = {p.slide_1, p.slide_2, p.twist, p.step};
    q[6] = quad(r.distribution.x, r.patch_radius);
    q[7] = quad(r.distribution.y, __builtin_bit_cast(float, bits));
    q[8] = quad(r.distribution.z, r.mass);
    q[9] = quad(r.arm_below, r.speed);
    q[10] = quad(r.arm_above, r.inverse_inertia);
    q[11] = quad(r.linear, r.weight_time);
    q[12] = quad(r.angular, 0);
    q[13] = quad(r.acceleration, 0);
  }

  FATHOM_HD ColumnRung rung(std::uint32_t k) const {
    const Quad* const from = at(k);
    Quad q[rung_quads];
    for (std::uint32_t i = 0; i < rung_quads; ++i) q[i] = from[i];
    ColumnRung r;
    r.n = q[0].xyz(), r.up = q[0].w;
    r.t1 = q[1].xyz(), r.friction = q[1].w;
    r.x[0] = q[2].x, r.x[1] = q[2].y, r.x[2] = q[2].z, r.x[3] = q[2].w;
    r.y[0] = q[3].x, r.y[1] = q[3].y, r.y[2] = q[3].z, r.y[3] = q[3].w;
    ContactImpulses& p = r.impulses;
    p.normal[0] = q[4].x, p.normal[1] = q[4].y, p.normal[2] = q[4].z, p.normal[3] = q[4].w;
    p.slide_1 = q[5].x, p.slide_2 = q[5].y, p.twist = q[5].z, p.step = q[5].w;
    r.distribution = {q[6].xyz(), q[7].xyz(), q[8].xyz()};
    r.patch_radius = q[6].w;
    const auto bits = __builtin_bit_cast(std::uint32_t, q[7].w);
    r.touches = bits & ~holds_bit, r.holds = bits & holds_bit;
    r.mass = q[8].w;
    r.arm_below = q[9].xyz(), r.speed = q[9].w;
    r.arm_above = q[10].xyz(), r.inverse_inertia = q[10].w;
    r.linear = q[11].xyz(), r.weight_time = q[11].w;
    r.angular = q[12].xyz();
    r.acceleration = q[13].xyz();
    return r;
  }
  FATHOM_HD SolverBody body(std::uint32_t j) const { return column.body(j); }
  FATHOM_HD Mat3 inertia(std::uint32_t j, float inverse) const { return column.inertia(j, inverse); }

  FATHOM_HD void put_change(std::uint32_t k, Vec3 target, const ColumnGain& gain, Vec3 spin) const {
    Quad* const q = at(k);
    q[9] = quad(target, 0);
    q[10] = quad(gain.linear, 0);
    q[11] = quad(gain.angular, 0);
    q[12] = quad(spin, 0);
  }
  FATHOM_HD void put_part(std::uint32_t k, float part) const { at(k)[9].w = part; }
  FATHOM_HD void put_base(std::uint32_t k, Vec3 target) const { at(k)[13] = quad(target, 1); }

  FATHOM_HD ColumnChange change(std::uint32_t k) const {
    const Quad* const q = at(k);
    return {q[9].xyz(), q[9].w, {q[10].xyz(), q[11].xyz()}, q[12].xyz(), q[13].xyz(), q[13].w != 0};
  }

 private:
  static constexpr std::uint32_t holds_bit = 1u << max_manifold_points;
};

/// A brace takes three phases: rungs of all contacts, the walks along columns, and the changes of all contacts.
struct SolveWithColumns {
  // Seven warps, and on CUDA an eighth that tells of their arrival: a ninth would leave each a third fewer registers.
  static constexpr std::uint32_t group_size = 224;
  static constexpr bool wants_registers = true;
  static constexpr std::uint32_t plan_parts = SolveConstraints::plan_parts;
  static constexpr std::uint32_t brace_phases = 3;
  using Plan = SolveConstraints::Plan;
  using Fetched = SolveConstraints::Fetched;
  enum Brace : std::uint32_t { no_brace, rungs, walks, changes };
  struct Place {
    SolveConstraints::Place in_solve;
    Brace brace;  ///< of the columns, after the sweep of `in_solve`
  };

  SolveConstraints solver;

  FATHOM_HD void plan_part(Plan& plan, std::uint32_t k) const { solver.plan_part(plan, k); }
  FATHOM_HD std::uint32_t phases(const Plan& plan) const {
    const std::uint32_t n = solver.all_phases(plan);
    return n && plan.columns ? n + brace_phases * 2 * solver.p.substeps : 0;
  }
  FATHOM_HD Place place(const Plan& plan, std::uint32_t phase) const {
    Place place{solver.place(plan, 0), no_brace};
    for (std::uint32_t k = 0; k < phase; ++k) place = next(plan, place);
    return place;
  }
  FATHOM_HD Place next(const Plan& plan, Place place) const {
    const SolveConstraints::Place& at = place.in_solve;
    if (place.brace == no_brace && is_braced(at.what) && at.colour + 1 == plan.sweeps) return {at, rungs};
    if (place.brace == rungs || place.brace == walks) return {at, static_cast<Brace>(place.brace + 1)};
    return {solver.next(plan, at), no_brace};
  }
  FATHOM_HD std::uint32_t items(const Plan& plan, Place place) const {
    if (place.brace == no_brace) return solver.items(plan, place.in_solve);
    return place.brace == walks ? plan.columns * column_spread(plan) : plan.column_contacts;
  }
  FATHOM_HD bool is_serial(const Plan& plan, Place place) const {
    return place.brace == no_brace && solver.is_serial(plan, place.in_solve);
  }
  FATHOM_HD void fetch(const Plan& plan, Place place, std::uint32_t i, Fetched& f) const {
    if (place.brace == no_brace) solver.fetch(plan, place.in_solve, i, f);
  }
  FATHOM_HD void operator()(const Plan& plan, Place place, std::uint32_t i, const Fetched& fetched) const {
    if (place.brace == walks) {
      const std::uint32_t spread = column_spread(plan);
      const ColumnRange range = solver.bodies.columns[i / spread];
      if (range.calm) walk(range, i % spread, spread);
    } else if (place.brace != no_brace) {
      brace(place, i);
    } else {
      solver(plan, place.in_solve, i, fetched);
    }
  }

 private:
  FATHOM_HD static bool is_braced(SolveConstraints::What what) {
    return what == SolveConstraints::push || what == SolveConstraints::push_first || what == SolveConstraints::relax;
  }
  /// Work-items for each column. One of them walks; before, all bring the rungs near.
  FATHOM_HD static std::uint32_t column_spread(const Plan& plan) {
    const std::uint32_t bodies = plan.bodies / plan.columns;
    return bodies < 32 ? bodies : 32;
  }
  FATHOM_HD ColumnView view(const ColumnRange& range) const {
    return {solver.bodies, solver.constraints, solver.p, solver.bodies.column_contacts + range.first};
  }
  FATHOM_HD Quad* quads(const ColumnRange& range) const {
    return solver.bodies.column_rungs + std::size_t{range.first} * rung_quads;
  }

  /// Contact i of all columns': its rung, or its changes.
  FATHOM_HD void brace(Place place, std::uint32_t i) const {
    const ColumnRange range = solver.bodies.columns[solver.bodies.column_contacts[i].column];
    if (!range.calm) return;
    const ColumnView column = view(range);
    const StoredRungs stored{column, quads(range)};
    const std::uint32_t k = i - range.first;
    const bool pushes_out = place.in_solve.what != SolveConstraints::relax;
    if (place.brace == rungs)
      stored.put(k, column_rung(column, k, column.body(k), column.body(k + 1), range.count, pushes_out));
    else
      change(column, stored, k, pushes_out);
  }

  FATHOM_HD void change(const ColumnView& column, const StoredRungs& stored, std::uint32_t k, bool pushes_out) const {
    const ColumnChange c = stored.change(k);
    if (!(c.part > 0)) return;
    const ContactImpulses impulses = column_impulses(stored.rung(k), c.gain, c.part, pushes_out);
    store_normal_impulses(column.rows(k), impulses);
    store_friction_impulses(column.rows(k), impulses);
    const auto turn = [&](std::uint32_t j, Vec3 target) {
      const SolverBody b = column.body(j);
      column.set_velocity(j, mul_add(b.linear, c.part, target - b.linear),
                          mul_add(b.angular, c.part, c.spin - b.angular));
    };
    turn(k + 1, c.target);
    if (c.moves_base) turn(k, c.base_target);
  }

  FATHOM_HD void walk(const ColumnRange& range, std::uint32_t item, std::uint32_t spread) const {
    const ColumnView column = view(range);
    const StoredRungs stored{column, quads(range)};
    for (std::uint32_t k = item; k < range.count; k += spread) exec::bring_near<rung_quads>(stored.at(k));
    if (item > 0) return;
    const ColumnWalk walk(stored, range.count);
    for (std::uint32_t begin = 0; begin < range.count;) {
      const ColumnPiece piece = walk.go_up(begin);
      if (piece.end > begin) hold(stored, walk, piece);
      if (piece.end < range.count) stored.put_part(piece.end, 0);
      begin = piece.end + 1;
    }
  }

  FATHOM_HD static void hold(const StoredRungs& stored, const ColumnWalk<StoredRungs>& walk, const ColumnPiece& piece) {
    float part = 1;
    const Vec3 base =
        walk.go_down(piece, [&](std::uint32_t k, const ColumnRung& r, const ColumnGain& gain, Vec3 target) {
          part = column_limits(r, gain, piece.weight).part_possible(part);
          stored.put_change(k, target, gain, piece.spin);
        });
    for (std::uint32_t k = piece.begin; k < piece.end; ++k) stored.put_part(k, part);
    if (stored.body(piece.begin).inverse_mass > 0) stored.put_base(piece.begin, base);
  }
};

}  // namespace fathom::device
