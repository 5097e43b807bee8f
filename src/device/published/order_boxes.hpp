// The list that sweep-and-sort sweeps: projected minima of all boxes, ascending (dissertation, section 3.3.1).
//
// An element is the minimum's projection a·min(B) on the unit axis a with components ≥ 0 (conditions 3.3 and 3.4), as
// bits that sort like the float, above the body's index: elements are unique and every target sorts identically.
// Rounding keeps condition 3.4: each operation of the dot product is monotonic, so p ≤ q gives a·p ≤ a·q in floats too.
//
// After bodies were added or removed, a bitonic merge sort sorts the whole list, padded to a power of two n, with one
// launch for each of its (log₂²n + log₂n)/2 steps. Otherwise it is nearly sorted: one launch sorts blocks in local
// memory, and a second one blocks shifted by half a block, so an element can move by at least half a block per step. An
// element that moves farther is out of order for some steps, and pairs may be missed meanwhile: a property of the
// method (docs/published-algorithms.md).
#pragma once

#include "device/access.hpp"
#include "device/contact_arrays.hpp"
#include "exec/group.hpp"
#include "exec/kernel.hpp"

namespace fathom::device {

/// Elements that a work-group sorts in local memory: the work-group size of the published measurements.
inline constexpr std::uint32_t sort_block = 1024;

/// Data passed between the sweep's kernels, and its part of the report.
struct SweepCounters {
  std::uint32_t elements = 0;  ///< of the list, a power of two; 0 if the step was stopped
  std::uint32_t pairs = 0;     ///< of elements compared by a step of the full sort
  std::uint32_t blocks = 0;
  std::uint32_t shifted_blocks = 0;
  std::uint32_t wide = 0;          ///< bodies too long to be in the list
  std::uint32_t max_overlaps = 0;  ///< c', the maximum found by one body
  std::uint32_t table_quads = 0;   ///< of the table of pairs, to be cleared
  std::uint32_t contacts = 0;      ///< to be entered into it
};

/// Parts of the sweep's data, for `Sweep`.
enum SweepPart : std::uint8_t { sweep_list, sweep_wide, sweep_overlaps, sweep_table, sweep_counters };

/// The sweep's data; the parts `written` may be written (access.hpp).
template <SweepPart... written>
struct Sweep {
  template <class T, SweepPart part>
  using Of = Array<T, part, written...>;

  Of<std::uint64_t, sweep_list> order;         ///< the list; a permutation of all indices below its size
  Of<std::uint32_t, sweep_overlaps> overlaps;  ///< c slots per body
  Of<std::uint32_t, sweep_overlaps> counts;    ///< slots in use, by body
  Of<std::uint32_t, sweep_wide> wide;          ///< list of bodies
  Of<std::uint64_t, sweep_table> pairs;        ///< hash table of existing contacts
  Of<SweepCounters, sweep_counters> counters;
  std::uint32_t slots;      ///< c
  std::uint32_t pair_mask;  ///< size of the table − 1
  Vec3 axis;                ///< unit, components ≥ 0
  float wide_length;        ///< m; longer intervals are wide

  template <SweepPart... fewer>
  FATHOM_HD operator Sweep<fewer...>() const {
    static_assert((is_among<fewer, written...> && ...));
    return __builtin_bit_cast(Sweep<fewer...>, *this);
  }
};

using SweepArrays = Sweep<sweep_list, sweep_wide, sweep_overlaps, sweep_table, sweep_counters>;

/// For an index without a body, or a wide body: sorts after all others.
inline constexpr std::uint64_t absent = std::uint64_t{0xffffffffu} << 32;

FATHOM_HD std::uint64_t sortable(float x) {
  const auto bits = __builtin_bit_cast(std::uint32_t, x);
  return bits >> 31 ? ~bits : bits | 0x80000000u;
}

/// Size of the list for so many body indices.
FATHOM_HD std::uint32_t list_size(std::uint32_t bodies) {
  std::uint32_t n = sort_block;
  while (n < bodies) n *= 2;
  return n;
}

struct BeginSweep {
  const Counters* counters;
  Sweep<sweep_counters> sweep;

  FATHOM_HD void operator()(std::uint32_t) const {
    SweepCounters& s = *sweep.counters;
    const bool run = counters->live_bodies > 0;
    s.elements = run ? list_size(counters->live_bodies) : 0;
    s.pairs = s.elements / 2;
    s.blocks = s.elements / sort_block;
    s.shifted_blocks = s.blocks > 0 ? s.blocks - 1 : 0;
    s.wide = 0;
    s.table_quads = run ? (sweep.pair_mask + 1) / 4 : 0;
    s.contacts = run ? counters->contacts : 0;
    if (run) s.max_overlaps = 0;
  }
};

/// Recomputes every element's projection, in place. `from_scratch` starts from the order of indices.
struct ProjectBoxes {
  Bodies<> bodies;
  const Counters* counters;
  Sweep<sweep_list, sweep_wide, sweep_counters> sweep;
  bool from_scratch;

  FATHOM_HD void operator()(std::uint32_t index) const {
    const std::uint32_t i = from_scratch ? index : static_cast<std::uint32_t>(sweep.order[index]);
    sweep.order[index] = key(i) | i;
  }

 private:
  FATHOM_HD std::uint64_t key(std::uint32_t i) const {
    if (i >= counters->live_bodies) return absent;
    const NotedBox fat = bodies.fat[i];
    if (!(fat.lower.x <= fat.upper.x)) return absent;
    const float first = dot(sweep.axis, fat.lower);
    if (dot(sweep.axis, fat.upper) - first > sweep.wide_length) {
      sweep.wide[exec::atomic_add(sweep.counters->wide, 1u)] = i;
      return absent;
    }
    return sortable(first) << 32;
  }
};

/// One step of the network: `run` is the length of the runs being merged, `apart` the distance between compared
/// elements.
struct NetworkStep {
  std::uint32_t run, apart;

  FATHOM_HD void compare(std::uint64_t* list, std::uint32_t pair) const {
    const std::uint32_t low = pair % apart, i = 2 * (pair - low) + low, j = i + apart;
    const bool ascending = (i & run) == 0;
    const std::uint64_t a = list[i], b = list[j];
    if ((a > b) == ascending) list[i] = b, list[j] = a;
  }
  FATHOM_HD NetworkStep next() const { return apart > 1 ? NetworkStep{run, apart / 2} : NetworkStep{2 * run, run}; }
};

/// A step of the full sort; runs longer than the list need no merging.
struct SortStep {
  Sweep<sweep_list> sweep;
  NetworkStep step;

  FATHOM_HD void operator()(std::uint32_t pair) const {
    if (step.run <= sweep.counters->elements) step.compare(sweep.order, pair);
  }
};

/// Sorts blocks of `block` elements, from element `first` on.
template <std::uint32_t block>
struct SortBlocks {
  static constexpr std::uint32_t group_size = block;
  struct Local {
    std::uint64_t list[block];
  };

  std::uint64_t* order;
  std::uint32_t first;

  FATHOM_HD void operator()(auto group, Local& local) const {
    std::uint64_t* const here = order + first + static_cast<std::size_t>(group.index()) * block;
    group.for_each([&](std::uint32_t item) { local.list[item] = here[item]; });
    for (NetworkStep step{2, 1}; step.run <= block; step = step.next())
      group.for_each(block / 2, [&](std::uint32_t pair) { step.compare(local.list, pair); });
    group.for_each([&](std::uint32_t item) { here[item] = local.list[item]; });
  }
};

}  // namespace fathom::device
