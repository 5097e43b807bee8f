// solve, where there are columns: as SolveConstraints, and columns are braced after every sweep (dynamics/columns.hpp).
//
// A kernel of its own, so that worlds without columns do not carry its registers. Of the two the one that is not due
// has no phases.
#pragma once

#include "device/solve.hpp"
#include "dynamics/column_links.hpp"
#include "exec/atomic.hpp"

namespace fathom::device {

/// A column's constraints and bodies.
struct ColumnView {
  const BodyArrays& bodies;
  const ConstraintArrays& constraints;
  const SolveParameters& p;
  ColumnContact* contacts;  ///< of the column, from its base

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
  FATHOM_HD SolverBody lower(std::uint32_t k) const { return body(k, contacts[k].below, !contacts[k].upward); }
  FATHOM_HD SolverBody upper(std::uint32_t k) const { return body(k, contacts[k].above, contacts[k].upward); }
  FATHOM_HD Vec3 acceleration(std::uint32_t j) const { return bodies.motion[index(j)].acceleration; }
  FATHOM_HD Mat3 inertia(std::uint32_t j, float inverse) const {
    if (inverse > 0) return column_inertia(inverse, {});
    const WorldInertia w = bodies.inertia[index(j)];
    return column_inertia(0, {w.xx, w.yy, w.zz, w.xy, w.xz, w.yz});
  }
  /// Goes that part of the way to a target. How often the quads were written stays as it is: nobody waits for them
  /// while columns are braced.
  FATHOM_HD void turn(std::uint32_t body, float part, Vec3 linear, Vec3 angular) const {
    SolverQuads& to = bodies.solver[body];
    const Vec3 v = to.linear.xyz(), w = to.angular.xyz();
    to.linear = quad(mul_add(v, part, linear - v), to.linear.w);
    to.angular = quad(mul_add(w, part, angular - w), to.angular.w);
  }

 private:
  /// A or B of contact k.
  FATHOM_HD SolverBody body(std::uint32_t k, std::uint32_t index, bool is_b) const {
    SolverBody b = bodies.solver[index].body();
    const Quad masses = rows(k)[mass_row * tile_width];
    b.inverse_mass = is_b ? masses.z : masses.x;
    b.inverse_inertia = is_b ? masses.w : masses.y;
    return b;
  }
};

/// What a contact is to change.
struct ColumnChange {
  std::uint32_t begin, end;  ///< its piece: bodies [begin, end]; both 0: nothing changes
  ColumnGift gift;
  Vec3 target, base_target, spin;
};

/// A column's rungs in memory: for each a link, which all contacts read, what is left of the rung, and what its contact
/// is to change, which takes the place of what is not read any more then.
struct StoredRungs {
  const ColumnView& column;
  Quad* quads;  ///< of the column

  FATHOM_HD Quad* at(std::uint32_t k) const { return quads + std::size_t{k} * rung_quads; }

  FATHOM_HD void put(std::uint32_t k, const ColumnRung& r) const {
    Quad* const q = at(k);
    const ColumnLink link = column_link(r, inertia(k + 1, r.inverse_inertia));
    const std::uint32_t bits = r.touches | (r.holds ? holds_bit : 0);
    q[0] = quad(link.arm, __builtin_bit_cast(float, bits));
    q[1] = quad(link.rise, link.mass);
    q[2] = quad(link.linear, link.inertia);
    q[3] = quad(link.spin_momentum, r.friction);
    q[4] = quad(link.weight, r.patch_radius);
    q[5] = {r.x[0], r.x[1], r.x[2], r.x[3]};
    q[6] = {r.y[0], r.y[1], r.y[2], r.y[3]};
    const ContactImpulses& p = r.impulses;
    q[7] = {p.normal[0], p.normal[1], p.normal[2], p.normal[3]};
    q[8] = {p.slide_1, p.slide_2, p.twist, p.step};
    q[9] = quad(r.n, r.up);
    q[10] = quad(r.t1, 0);
    q[11] = quad(r.arm_above, r.distribution.x.x);
    const Mat3& d = r.distribution;  // symmetric
    q[12] = {d.x.y, d.x.z, d.y.y, d.y.z};
    q[13].x = d.z.z;
    exec::atomic_store(column.contacts[k].part, __builtin_bit_cast(std::uint32_t, 1.0f));
  }

  FATHOM_HD ColumnLink link(std::uint32_t k) const {
    const Quad* const q = at(k);
    ColumnLink link;
    link.arm = q[0].xyz(), link.rise = q[1].xyz(), link.linear = q[2].xyz();
    link.spin_momentum = q[3].xyz(), link.weight = q[4].xyz();
    link.mass = q[1].w, link.inertia = q[2].w;
    return link;
  }
  FATHOM_HD bool holds(std::uint32_t k) const { return (bits(k) & holds_bit) != 0; }
  FATHOM_HD SolverBody lower(std::uint32_t k) const { return column.lower(k); }
  FATHOM_HD Mat3 inertia(std::uint32_t j, float inverse) const { return column.inertia(j, inverse); }

  /// What is not read after `put_change`.
  FATHOM_HD ColumnRung rung(std::uint32_t k) const {
    const Quad* const q = at(k);
    ColumnRung r = points(k);
    r.friction = q[3].w, r.patch_radius = q[4].w;
    r.n = q[9].xyz(), r.up = q[9].w;
    r.t1 = q[10].xyz();
    r.arm_above = q[11].xyz();
    const Quad d = q[12];
    r.distribution = {{q[11].w, d.x, d.y}, {d.x, d.z, d.w}, {d.y, d.w, q[13].x}};
    return r;
  }
  FATHOM_HD ColumnRung points(std::uint32_t k) const {
    const Quad* const q = at(k);
    ColumnRung r;
    r.touches = bits(k) & ~holds_bit;
    r.x[0] = q[5].x, r.x[1] = q[5].y, r.x[2] = q[5].z, r.x[3] = q[5].w;
    r.y[0] = q[6].x, r.y[1] = q[6].y, r.y[2] = q[6].z, r.y[3] = q[6].w;
    ContactImpulses& p = r.impulses;
    p.normal[0] = q[7].x, p.normal[1] = q[7].y, p.normal[2] = q[7].z, p.normal[3] = q[7].w;
    p.slide_1 = q[8].x, p.slide_2 = q[8].y, p.twist = q[8].z, p.step = q[8].w;
    return r;
  }

  FATHOM_HD void put_change(std::uint32_t k, const ColumnHold& h, const ColumnGift& g) const {
    Quad* const q = at(k);
    q[9] = {g.slide_1, g.slide_2, g.twist, 0};
    q[10] = quad(g.multipliers, 0);
    q[11] = quad(h.target, __builtin_bit_cast(float, h.begin));
    q[12] = quad(h.spin, __builtin_bit_cast(float, h.end));
    q[13].x = h.base_target.x, q[13].y = h.base_target.y, q[13].z = h.base_target.z;
  }
  FATHOM_HD ColumnChange change(std::uint32_t k) const {
    const Quad* const q = at(k);
    const ColumnGift gift{q[10].xyz(), 0, q[9].x, q[9].y, q[9].z};
    return {__builtin_bit_cast(std::uint32_t, q[11].w),
            __builtin_bit_cast(std::uint32_t, q[12].w),
            gift,
            q[11].xyz(),
            q[13].xyz(),
            q[12].xyz()};
  }

  /// The piece that begins with contact k goes that part of its way at most.
  FATHOM_HD void limit_part(std::uint32_t k, float part) const {
    // Numbers that are not negative are in the order of their bits.
    exec::atomic_min(column.contacts[k].part, part > 0 ? __builtin_bit_cast(std::uint32_t, part) : 0u);
  }
  FATHOM_HD float part(std::uint32_t k) const {
    return __builtin_bit_cast(float, exec::atomic_load(column.contacts[k].part));
  }

 private:
  static constexpr std::uint32_t holds_bit = 1u << max_manifold_points;
  FATHOM_HD std::uint32_t bits(std::uint32_t k) const { return __builtin_bit_cast(std::uint32_t, at(k)[0].w); }
};

/// A brace takes three phases: rungs of all contacts, what they are to do, and that part of it that all of their piece
/// can. A column's contacts are the same items' in each, which wait for nobody else; before and after a brace all wait
/// for all, between sweeps for data only, if they can.
struct SolveWithColumns {
  // Seven warps, and on CUDA an eighth that tells of their arrival: a ninth would leave each a third fewer registers.
  static constexpr std::uint32_t group_size = 224;
  static constexpr bool wants_registers = true;
  static constexpr std::uint32_t plan_parts = SolveConstraints::plan_parts;
  static constexpr std::uint32_t brace_phases = 3;
  struct Plan : SolveConstraints::Plan {
    std::uint32_t log_lanes;  ///< a column's work-items are 2 to the power of it, within 32 in a row
  };
  using Fetched = SolveConstraints::Fetched;
  enum Brace : std::uint32_t { no_brace, rungs, holds, changes };
  struct Place {
    SolveConstraints::Place in_solve;
    Brace brace;  ///< of the columns, after the sweep of `in_solve`
    bool follows_brace;
  };

  SolveConstraints solver;

  FATHOM_HD void plan_part(Plan& plan, std::uint32_t k) const {
    solver.plan_part(plan, k);
    if (k > 0) return;
    plan.log_lanes = 5;
    while (plan.columns << plan.log_lanes > plan.bodies) --plan.log_lanes;
  }
  FATHOM_HD void keep_barriers(Plan& plan) const { solver.keep_barriers(plan); }
  FATHOM_HD std::uint32_t phases(const Plan& plan) const {
    const std::uint32_t n = solver.all_phases(plan);
    return n && plan.columns ? n + brace_phases * 2 * solver.p.substeps : 0;
  }
  FATHOM_HD Place place(const Plan& plan, std::uint32_t phase) const {
    Place place{solver.place(plan, 0), no_brace, false};
    for (std::uint32_t k = 0; k < phase; ++k) place = next(plan, place);
    return place;
  }
  FATHOM_HD Place next(const Plan& plan, Place place) const {
    const SolveConstraints::Place& at = place.in_solve;
    if (place.brace == no_brace && is_braced(at.what) && at.colour + 1 == plan.sweeps) return {at, rungs, false};
    if (place.brace == rungs || place.brace == holds) return {at, static_cast<Brace>(place.brace + 1), false};
    return {solver.next(plan, at), no_brace, place.brace == changes};
  }
  FATHOM_HD void report_overrun() const { solver.report_overrun(); }
  FATHOM_HD std::uint32_t items(const Plan& plan, Place place) const {
    return place.brace == no_brace ? solver.items(plan, place.in_solve) : plan.columns << plan.log_lanes;
  }
  FATHOM_HD bool is_serial(const Plan& plan, Place place) const {
    return place.brace == no_brace && solver.is_serial(plan, place.in_solve);
  }
  FATHOM_HD exec::Wait wait_before(const Plan& plan, Place place) const {
    if (place.brace == holds || place.brace == changes) return exec::Wait::for_warp;
    const bool at_brace = place.brace == rungs || place.follows_brace;
    return at_brace || !plan.by_data ? exec::Wait::for_all : exec::Wait::for_data;
  }
  FATHOM_HD void fetch(const Plan& plan, Place place, std::uint32_t i, Fetched& f) const {
    if (place.brace == no_brace) solver.fetch(plan, place.in_solve, i, f);
  }
  FATHOM_HD void operator()(const Plan& plan, Place place, std::uint32_t i, const Fetched& fetched) const {
    if (place.brace == no_brace)
      solver(plan, place.in_solve, i, fetched);
    else
      brace(plan, place, i);
  }

 private:
  FATHOM_HD static bool is_braced(SolveConstraints::What what) {
    return what == SolveConstraints::push || what == SolveConstraints::push_first || what == SolveConstraints::relax;
  }

  FATHOM_HD void brace(const Plan& plan, Place place, std::uint32_t i) const {
    const ColumnRange range = solver.bodies.columns[i >> plan.log_lanes];
    if (!range.calm) return;
    const ColumnView column{solver.bodies, solver.constraints, solver.p, solver.bodies.column_contacts + range.first};
    const StoredRungs stored{column, solver.bodies.column_rungs + std::size_t{range.first} * rung_quads};
    const bool pushes_out = place.in_solve.what != SolveConstraints::relax;
    const std::uint32_t lanes = 1u << plan.log_lanes, first = i & (lanes - 1);
    if (place.brace != rungs)
      for (std::uint32_t k = first; k < range.count; k += lanes) exec::bring_near<rung_quads>(stored.at(k));
    for (std::uint32_t k = first; k < range.count; k += lanes) {
      if (place.brace == rungs)
        stored.put(k, column_rung(column, k, column.lower(k), column.upper(k), range.count, pushes_out));
      else if (place.brace == holds)
        hold(stored, range.count, k);
      else
        change(column, stored, k, pushes_out);
    }
  }

  FATHOM_HD static void hold(const StoredRungs& stored, std::uint32_t contacts, std::uint32_t k) {
    const ColumnRung r = stored.rung(k);
    const ColumnHold h = ColumnHolds(stored, contacts).hold(k, r.arm_above);
    const ColumnGift gift = column_gift(r, h.gain);
    stored.put_change(k, h, gift);
    if (h.end == h.begin) return;
    // Where a body is not finite its piece stays as it is: a brace must not carry that to all of the column.
    const bool finite = is_finite(gift.multipliers.x + gift.multipliers.y + gift.multipliers.z + gift.load +
                                  gift.slide_1 + gift.slide_2 + gift.twist);
    stored.limit_part(h.begin, finite ? column_limits(r, gift, h.weight).part_possible(1) : 0.0f);
  }

  FATHOM_HD static void change(const ColumnView& column, const StoredRungs& stored, std::uint32_t k, bool pushes_out) {
    const ColumnChange c = stored.change(k);
    if (c.begin == c.end) return;
    const float part = stored.part(c.begin);
    if (!(part > 0)) return;
    const ContactImpulses impulses = column_impulses(stored.points(k), c.gift, part, pushes_out);
    store_normal_impulses(column.rows(k), impulses);
    store_friction_impulses(column.rows(k), impulses);
    column.turn(column.contacts[k].above, part, c.target, c.spin);
    if (k == c.begin && column.lower(k).inverse_mass > 0)
      column.turn(column.contacts[k].below, part, c.base_target, c.spin);
  }
};

}  // namespace fathom::device
