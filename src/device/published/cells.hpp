// The partition of constraints into cells, cell groups and batches (dissertation, sections 2.2.3, 2.2.6 and 3.4; Le
// Grand 2007, Harada 2011).
//
// A uniform grid of s_gc cells per side covers the bodies; each cell is halved along each axis into 2³ parts. The same
// part of all cells is a cell group; groups are processed one after the other. A constraint belongs to the lower of its
// bodies' parts along each axis, so it reaches only into the next part, and constraints of one group in different cells
// never share a body: work-groups need not wait for each other. (With the part of body A, as the text says, they would
// share bodies in between, and two work-groups would change one body at the same time.) This requires that a part be at
// least as large as the largest box of a body that can be pushed. Bodies that cannot be pushed are never written, so
// they neither count for the grid's extents nor are marked.
//
// In its work-group a part's constraints are assigned to batches, in rounds: each marks both bodies in an array per
// cell group, and a contact that owns both marks joins this round's batch. In the text any contact may win; here the
// one with the higher hash of pair and step does, so the outcome does not depend on timing.
//
// Constraints beyond the n_wi of a work-group, and those without a batch after the last round, are not solved in this
// step; they are counted.
#pragma once

#include "device/build_constraints.hpp"
#include "device/contact_arrays.hpp"
#include "exec/group.hpp"
#include "exec/kernel.hpp"

namespace fathom::device {

inline constexpr std::uint32_t cell_groups = 8;
/// s_wg, the largest work-group: constraints need many registers each.
inline constexpr std::uint32_t max_work_items = 256;

/// Equations 3.24 to 3.27 for d = 3.
struct CellPlan {
  std::uint32_t side = 0;         ///< s_gc, cells along each side of the grid
  std::uint32_t work_groups = 0;  ///< n_wg = s_gc³
  std::uint32_t work_items = 0;   ///< n_wi, a power of two
};
FATHOM_HD CellPlan plan_cells(std::uint64_t overlaps) {
  const auto divided = [](std::uint64_t a, std::uint64_t b) { return static_cast<std::uint32_t>((a + b - 1) / b); };
  const std::uint32_t estimate = divided(overlaps, std::uint64_t{cell_groups} * max_work_items);
  CellPlan plan{1, 1, 1};
  while (plan.side * plan.side * plan.side < estimate) ++plan.side;
  plan.work_groups = plan.side * plan.side * plan.side;
  const std::uint32_t share = divided(overlaps, std::uint64_t{cell_groups} * plan.work_groups);
  while (plan.work_items < share) plan.work_items *= 2;
  return plan;
}

/// Extents of the boxes of all movable bodies.
struct WorldExtents {
  Vec3 lower{3e38f, 3e38f, 3e38f}, upper{-3e38f, -3e38f, -3e38f};
  Vec3 largest;  ///< of any box (m)
};
struct LoadExtents {
  Bodies<> bodies;

  FATHOM_HD WorldExtents operator()(std::uint32_t i) const {
    const NotedBox fat = bodies.fat[i];
    if (!(fat.lower.x <= fat.upper.x) || !bodies.constants[i].is_dynamic()) return {};
    return {fat.lower, fat.upper, fat.upper - fat.lower};
  }
};
struct UniteExtents {
  FATHOM_HD WorldExtents operator()(const WorldExtents& a, const WorldExtents& b) const {
    return {min(a.lower, b.lower), max(a.upper, b.upper), max(a.largest, b.largest)};
  }
};

struct CellCounters {
  std::uint32_t side = 1, work_groups = 0, work_items = 0;
  std::uint32_t lists = 0;  ///< one per part of a cell: 2³ n_wg, or 0 if the step was stopped
  Vec3 origin, inverse_edge;
  std::uint32_t unbatched = 0;  ///< constraints not solved in this step
  std::uint32_t batches = 0;    ///< maximum in any work-group
};

/// A constraint in its work-group.
struct alignas(8) CellSlot {
  std::uint32_t constraint, batch;
};

/// Parts of the partition's data, for `Cells`.
enum CellPart : std::uint8_t { cell_plan, cell_lists, cell_batches };

/// The partition's data; the parts `written` may be written (access.hpp).
template <CellPart... written>
struct Cells {
  template <class T, CellPart part>
  using Of = Array<T, part, written...>;

  Of<CellCounters, cell_plan> counters;
  const WorldExtents* extents;
  Of<std::uint32_t, cell_lists> list_of;  ///< by constraint
  Of<std::uint32_t, cell_lists> members;  ///< constraints, list by list
  Of<CellSlot, cell_batches> slots;       ///< constraints with their batches
  // By list.
  Of<std::uint32_t, cell_lists> counts;
  Of<std::uint32_t, cell_lists> cursors;
  Of<std::uint32_t, cell_lists> firsts;
  Of<std::uint32_t, cell_batches> used;  ///< number of slots
  Of<std::uint32_t, cell_batches> batches;
  Of<std::uint64_t, cell_batches> marks;  ///< of body b in cell group g: g · bodies + b
  std::uint32_t body_capacity;
  std::uint32_t rounds;  ///< of marking

  template <CellPart... fewer>
  FATHOM_HD operator Cells<fewer...>() const {
    static_assert((is_among<fewer, written...> && ...));
    return __builtin_bit_cast(Cells<fewer...>, *this);
  }
};

using CellArrays = Cells<cell_plan, cell_lists, cell_batches>;

struct PlanCells {
  const Counters* counters;
  Cells<cell_plan> cells;
  std::uint32_t slots;  ///< c: n_overlap = n × c

  FATHOM_HD void operator()(std::uint32_t) const {
    CellCounters& c = *cells.counters;
    c.unbatched = c.batches = 0;
    c.lists = c.work_groups = 0;
    if (counters->live_bodies == 0) return;
    const CellPlan plan = plan_cells(std::uint64_t{counters->live_bodies} * slots);
    c.side = plan.side;
    c.work_groups = plan.work_groups;
    c.work_items = plan.work_items;
    c.lists = cell_groups * plan.work_groups;
    const WorldExtents world = *cells.extents;
    c.origin = world.lower;
    const Vec3 part = (1.0f / static_cast<float>(2 * plan.side)) * (world.upper - world.lower);
    // One percent for the rounding of centres.
    const Vec3 edge = max(part, 1.01f * world.largest);
    c.inverse_edge = {1.0f / max(edge.x, 1e-6f), 1.0f / max(edge.y, 1e-6f), 1.0f / max(edge.z, 1e-6f)};
  }
};

struct ClearLists {
  Cells<cell_lists> cells;

  FATHOM_HD void operator()(std::uint32_t list) const { cells.counts[list] = cells.cursors[list] = 0; }
};

/// Finds the list of each constraint, and counts the constraints of each list.
struct CountCells {
  Bodies<> bodies;
  Contacts<> contacts;
  Constraints<> constraints;
  Cells<cell_lists> cells;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const Contact& c = contacts.contacts[constraints.contact[k]];
    const Part b = part_of(c.b);
    const std::uint32_t list = list_at(c.fixed_a() ? b : lower(b, part_of(c.a)));
    cells.list_of[k] = list;
    exec::atomic_add(cells.counts[list], 1u);
  }

 private:
  struct Part {
    std::uint32_t x, y, z;
  };

  FATHOM_HD std::uint32_t coordinate(float x) const {
    return static_cast<std::uint32_t>(clamp(x, 0.0f, static_cast<float>(2 * cells.counters->side - 1)));
  }
  FATHOM_HD Part part_of(std::uint32_t body) const {
    const CellCounters& c = *cells.counters;
    const bool has_box = !bodies.constants[body].is_compound();
    const Vec3 p = (has_box ? centre(bodies.fat[body].box()) : bodies.poses[body].position) - c.origin;
    return {coordinate(p.x * c.inverse_edge.x), coordinate(p.y * c.inverse_edge.y), coordinate(p.z * c.inverse_edge.z)};
  }
  FATHOM_HD static Part lower(Part a, Part b) {
    return {a.x < b.x ? a.x : b.x, a.y < b.y ? a.y : b.y, a.z < b.z ? a.z : b.z};
  }
  FATHOM_HD std::uint32_t list_at(Part p) const {
    const CellCounters& c = *cells.counters;
    const std::uint32_t group = (p.x & 1u) | (p.y & 1u) << 1 | (p.z & 1u) << 2;
    return group * c.work_groups + (p.x >> 1) + c.side * ((p.y >> 1) + c.side * (p.z >> 1));
  }
};

struct FillCells {
  Cells<cell_lists> cells;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const std::uint32_t list = cells.list_of[k];
    cells.members[cells.firsts[list] + exec::atomic_add(cells.cursors[list], 1u)] = k;
  }
};

/// Chooses n_wi constraints of a list that has more, and assigns them to batches.
struct MakeBatches {
  static constexpr std::uint32_t group_size = max_work_items;
  struct Local {
    std::uint32_t members[max_work_items];
    std::uint32_t count, left;
  };

  Bodies<> bodies;
  Contacts<> contacts;
  Constraints<> constraints;
  const Counters* counters;
  Cells<cell_plan, cell_batches> cells;

  FATHOM_HD void operator()(auto group, Local& local) const {
    const std::uint32_t list = group.index(), first = cells.firsts[list], all = cells.counts[list];
    const std::uint64_t below = all > cells.counters->work_items ? limit(group, local, first, all) : ~std::uint64_t{0};
    group.once([&] { local.count = 0; });
    group.for_each(all, [&](std::uint32_t k) {
      const std::uint32_t constraint = cells.members[first + k];
      if (rank(constraint) < below) local.members[exec::atomic_add(local.count, 1u)] = constraint;
    });
    const std::uint32_t n = group.broadcast(local.count);
    auto batch = per_item<std::uint32_t>(group);
    auto mine = per_item<std::uint64_t>(group);
    group.for_each(n, [&](std::uint32_t item) {
      batch[item] = none;
      mine[item] = rank(local.members[item]);
    });
    std::uint32_t left = n, round = 0;
    for (; round < cells.rounds && left > 0; ++round) {
      group.once([&] { local.left = 0; });
      // Later rounds have higher values, so earlier marks need no clearing.
      const std::uint64_t base = std::uint64_t{round + 1} << 56;
      group.for_each(n, [&](std::uint32_t item) {
        if (batch[item] == none) mark(list, local.members[item], base | mine[item]);
      });
      group.for_each(n, [&](std::uint32_t item) {
        if (batch[item] != none) return;
        if (holds(list, local.members[item], base | mine[item]))
          batch[item] = round;
        else
          exec::atomic_add(local.left, 1u);
      });
      left = group.broadcast(local.left);
    }
    group.for_each(n, [&](std::uint32_t item) { cells.slots[first + item] = {local.members[item], batch[item]}; });
    group.once([&] {
      cells.used[list] = n;
      cells.batches[list] = round;
      if (all - n + left > 0) exec::atomic_add(cells.counters->unbatched, all - n + left);
      if (round > exec::atomic_load(cells.counters->batches)) exec::atomic_max(cells.counters->batches, round);
    });
  }

 private:
  /// Differs from step to step: not always the same constraints lose.
  FATHOM_HD std::uint64_t rank(std::uint32_t constraint) const {
    const TouchingPieces pieces = ranked_pieces(bodies, contacts.contacts[constraints.contact[constraint]]);
    constexpr std::uint64_t mask = (std::uint64_t{1} << 56) - 1;
    return (priority(pieces.a, pieces.b) ^ (std::uint64_t{counters->step} * 0x9e3779b97f4a7c15u & mask)) *
               0xd6e8feb86659fd93u &
           mask;
  }

  /// The largest rank limit, to 2⁻³² of the range, below which there are at most n_wi constraints.
  FATHOM_HD std::uint64_t limit(auto group, Local& local, std::uint32_t first, std::uint32_t all) const {
    std::uint64_t below = 0;
    for (std::uint64_t bit = std::uint64_t{1} << 55; bit >= 1u << 24; bit >>= 1) {
      group.once([&] { local.count = 0; });
      group.for_each(all, [&](std::uint32_t k) {
        if (rank(cells.members[first + k]) < (below | bit)) exec::atomic_add(local.count, 1u);
      });
      if (group.broadcast(local.count) <= cells.counters->work_items) below |= bit;
    }
    return below;
  }

  FATHOM_HD std::uint64_t& mark_of(std::uint32_t list, std::uint32_t body) const {
    const std::uint32_t group = list / cells.counters->work_groups;
    return cells.marks[static_cast<std::size_t>(group) * cells.body_capacity + body];
  }
  FATHOM_HD bool fixed_a(std::uint32_t constraint) const {
    return contacts.contacts[constraints.contact[constraint]].fixed_a();
  }
  FATHOM_HD void mark(std::uint32_t list, std::uint32_t constraint, std::uint64_t key) const {
    const PairRecord pair = constraints.bodies[constraint];
    exec::atomic_max(mark_of(list, pair.b), key);
    if (!fixed_a(constraint)) exec::atomic_max(mark_of(list, pair.a), key);
  }
  FATHOM_HD bool holds(std::uint32_t list, std::uint32_t constraint, std::uint64_t key) const {
    const PairRecord pair = constraints.bodies[constraint];
    return exec::atomic_load(mark_of(list, pair.b)) == key &&
           (fixed_a(constraint) || exec::atomic_load(mark_of(list, pair.a)) == key);
  }
};

}  // namespace fathom::device
