// The dissertation's strategies as parts of a step: their memory, and the order of their kernels.
#pragma once

#include <bit>
#include <type_traits>

#include "device/published/cells.hpp"
#include "device/published/solve_cells.hpp"
#include "device/published/sweep_boxes.hpp"
#include "exec/buffer.hpp"
#include "exec/device.hpp"
#include "exec/reduce.hpp"

namespace fathom::device {

/// Results that the host reads after a step, in pinned memory.
struct PublishedReport {
  std::uint32_t max_overlaps = 0;
  std::uint32_t unbatched = 0, batches = 0, work_groups = 0;
};

struct WritePublishedReport {
  const Counters* counters;
  const SweepCounters* sweep;
  const CellCounters* cells;
  PublishedReport* reports;
  std::uint32_t report_count;

  // A stopped step is reported under the number it would have had; this runs before `step` is incremented.
  FATHOM_HD void operator()(std::uint32_t) const {
    reports[(counters->step + 1) % report_count] = {sweep->max_overlaps, cells->unbatched, cells->batches,
                                                    cells->work_groups};
  }
};

/// Initial c.
inline constexpr std::uint32_t first_slots = 8;
/// Length, in cells of the finest grid, above which a body overlaps too many others to find them itself.
inline constexpr float wide_bodies = 8;

/// The strategies that a step uses, and their parameters.
struct PublishedSettings {
  bool sweep = false;
  bool cells = false;
  Vec3 axis;                 ///< unit
  float wide_length = 0;     ///< m
  std::uint32_t rounds = 0;  ///< of marking
};

/// Capacities of the buffers.
struct PublishedRoom {
  std::size_t bodies = 0, contacts = 0, constraints = 0;
  std::uint32_t slots = 0;  ///< overlaps of a body

  bool operator==(const PublishedRoom&) const = default;
};

/// Memory of the strategies in use. `D` determines how much scratch its scan needs.
template <exec::Device D>
class PublishedMemory {
 public:
  PublishedMemory(D& device, std::size_t report_count)
      : reports(device, report_count),
        order(device),
        device_(device),
        overlaps_(device),
        counts_(device),
        wide_(device),
        pairs_(device),
        sweep_counters_(device, 1),
        cell_counters_(device, 1),
        extents_(device, 1),
        list_of_(device),
        members_(device),
        slots_(device),
        lists_(device),
        marks_(device),
        scratch_(device) {
    device_.zero(sweep_counters_.data(), 1);
    device_.zero(cell_counters_.data(), 1);
  }

  exec::PinnedBuffer<PublishedReport> reports;
  exec::Buffer<std::uint64_t> order;  ///< outlasts a step

  /// Whether the capacities differ from those requested.
  bool needs(const PublishedSettings& settings, const PublishedRoom& room) const {
    return (settings.sweep || settings.cells) && room != room_;
  }
  void reserve(const PublishedSettings& settings, const PublishedRoom& room) {
    if (!needs(settings, room)) return;
    room_ = room;
    if (settings.sweep) {
      order.grow(std::max<std::size_t>(std::bit_ceil(room.bodies), sort_block));
      overlaps_.grow(room.bodies * room.slots);
      counts_.grow(room.bodies);
      wide_.grow(room.bodies);
      pairs_.grow(std::bit_ceil(2 * room.contacts));
    }
    if (settings.cells) {
      max_work_groups_ = plan_cells(std::uint64_t{room.bodies} * room.slots).work_groups;
      list_of_.grow(room.constraints);
      members_.grow(room.constraints);
      slots_.grow(room.constraints);
      lists_.grow(std::size_t{5} * max_lists());
      marks_.grow(cell_groups * room.bodies);
      scratch_.reserve(std::max(device_.scan_scratch_bytes(max_lists()), exec::reduce_scratch_bytes<WorldExtents>()));
    }
  }
  std::uint32_t slots_per_body() const { return room_.slots; }
  std::uint32_t max_work_groups() const { return max_work_groups_; }
  std::uint32_t max_lists() const { return cell_groups * max_work_groups_; }
  exec::Scratch& scratch() { return scratch_; }
  WorldExtents* extents() { return extents_.data(); }
  std::uint32_t elements() const { return static_cast<std::uint32_t>(order.size()); }

  SweepArrays sweep(const PublishedSettings& settings) {
    return {.order = order.data(),
            .overlaps = overlaps_.data(),
            .counts = counts_.data(),
            .wide = wide_.data(),
            .pairs = pairs_.data(),
            .counters = sweep_counters_.data(),
            .slots = room_.slots,
            .pair_mask = static_cast<std::uint32_t>(pairs_.size() - 1),
            .axis = settings.axis,
            .wide_length = settings.wide_length};
  }
  CellArrays cells(const PublishedSettings& settings) {
    const std::size_t n = max_lists();
    return {.counters = cell_counters_.data(),
            .extents = extents_.data(),
            .list_of = list_of_.data(),
            .members = members_.data(),
            .slots = slots_.data(),
            .counts = lists_.data(),
            .cursors = lists_.data() + n,
            .firsts = lists_.data() + 2 * n,
            .used = lists_.data() + 3 * n,
            .batches = lists_.data() + 4 * n,
            .marks = marks_.data(),
            .body_capacity = static_cast<std::uint32_t>(room_.bodies),
            .rounds = settings.rounds};
  }

 private:
  D& device_;
  PublishedRoom room_;
  std::uint32_t max_work_groups_ = 0;
  exec::Buffer<std::uint32_t> overlaps_, counts_, wide_;
  exec::Buffer<std::uint64_t> pairs_;
  exec::Buffer<SweepCounters> sweep_counters_;
  exec::Buffer<CellCounters> cell_counters_;
  exec::Buffer<WorldExtents> extents_;
  exec::Buffer<std::uint32_t> list_of_, members_;
  exec::Buffer<CellSlot> slots_;
  exec::Buffer<std::uint32_t> lists_;
  exec::Buffer<std::uint64_t> marks_;
  exec::Scratch scratch_;
};

/// The published parts of one step.
template <exec::Device D>
class PublishedStep {
 public:
  PublishedStep(D& device, PublishedMemory<D>& memory, const PublishedSettings& settings, const BodyArrays& bodies,
                const ContactArrays& contacts, const ConstraintArrays& constraints, Counters* counters,
                std::uint32_t body_capacity)
      : device_(device),
        memory_(memory),
        settings_(settings),
        bodies_(bodies),
        contacts_(contacts),
        constraints_(constraints),
        counters_(counters),
        body_capacity_(body_capacity) {}

  /// Replaces the search in the grid; a list whose set of bodies changed is sorted from scratch.
  void find_pairs(bool set_changed) {
    const SweepArrays sweep = memory_.sweep(settings_);
    SweepCounters* const c = sweep.counters;
    const std::uint32_t elements = memory_.elements();
    device_.parallel_for(1, BeginSweep{counters_, sweep});
    device_.parallel_for({&c->elements, elements}, ProjectBoxes{bodies_, counters_, sweep, set_changed});
    if (set_changed) {
      for (NetworkStep step{2, 1}; step.run <= elements; step = step.next())
        device_.parallel_for({&c->pairs, elements / 2}, SortStep{sweep, step});
    } else {
      device_.parallel_groups({&c->blocks, elements / sort_block}, SortBlocks<sort_block>{sweep.order, 0});
      if (elements > sort_block)
        device_.parallel_groups({&c->shifted_blocks, elements / sort_block - 1},
                                SortBlocks<sort_block>{sweep.order, sort_block / 2});
    }
    device_.parallel_for({&c->table_quads, (sweep.pair_mask + 1) / 4}, ClearPairs{sweep});
    device_.parallel_for({&c->contacts, contacts_.capacity}, EnterPairs{bodies_, contacts_, sweep});
    device_.parallel_for({&c->elements, elements}, SweepBoxes{bodies_, counters_, sweep});
    device_.parallel_groups(live_bodies(), TakeOverlaps{bodies_, contacts_, counters_, sweep});
    device_.parallel_for(1, CheckSlots{counters_, sweep});
  }

  /// The world's extents, found together with pairs.
  void measure_world() {
    exec::reduce(device_, memory_.scratch(), live_bodies(), LoadExtents{bodies_}, UniteExtents{}, WorldExtents{},
                 memory_.extents());
  }

  /// Replaces colouring.
  void partition(exec::Range constraints) {
    const CellArrays cells = memory_.cells(settings_);
    const exec::Range lists{&cells.counters->lists, memory_.max_lists()};
    device_.parallel_for(1, PlanCells{counters_, cells, memory_.slots_per_body()});
    device_.parallel_for(lists, ClearLists{cells});
    device_.zero(cells.marks, std::size_t{cell_groups} * body_capacity_);
    device_.parallel_for(constraints, CountCells{bodies_, contacts_, constraints_, cells});
    device_.exclusive_scan(memory_.scratch(), lists, cells.counts, cells.firsts);
    device_.parallel_for(constraints, FillCells{cells});
    device_.parallel_groups(lists, MakeBatches{bodies_, contacts_, constraints_, counters_, cells});
  }

  void solve(const SolveContacts& solver, bool bounces, exec::Range constraints) {
    const CellArrays cells = memory_.cells(settings_);
    submit_cell_substeps(device_, solver, cells, solver.p.warm_start, bounces, live_bodies(), constraints,
                         {&cells.counters->work_groups, memory_.max_work_groups()});
  }

  void report() {
    device_.parallel_for(
        1, WritePublishedReport{counters_, memory_.sweep(settings_).counters, memory_.cells(settings_).counters,
                                memory_.reports.data(), static_cast<std::uint32_t>(memory_.reports.size())});
  }

 private:
  exec::Range live_bodies() const { return {&counters_->live_bodies, body_capacity_}; }

  D& device_;
  PublishedMemory<D>& memory_;
  PublishedSettings settings_;
  BodyArrays bodies_;
  ContactArrays contacts_;
  ConstraintArrays constraints_;
  Counters* counters_;
  std::uint32_t body_capacity_;
};

}  // namespace fathom::device
