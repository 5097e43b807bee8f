// The sweep: each body scans forward from its minimum in the sorted list until it passes its maximum (condition 3.6),
// and stores the bodies whose boxes overlap its own (test 3.2) in its c slots.
//
// The contacts of the device simulator outlast a step, so only overlaps that are not contacts yet are passed on,
// according to a table of contacts. Overlap of a pair's boxes in the previous step would not suffice as a criterion,
// because the sweep may have missed it.
#pragma once

#include "device/published/order_boxes.hpp"
#include "exec/atomic.hpp"

namespace fathom::device {

// The table of pairs ---------------------------------------------------------------------------------------------

FATHOM_HD std::uint64_t pair_key(std::uint32_t a, std::uint32_t b) {
  return a < b ? std::uint64_t{a} << 32 | b : std::uint64_t{b} << 32 | a;
}
inline constexpr std::uint64_t no_pair = ~std::uint64_t{0};

FATHOM_HD std::uint32_t pair_slot(std::uint64_t key, std::uint32_t mask) {
  key *= 0x9e3779b97f4a7c15u;
  return static_cast<std::uint32_t>(key >> 32) & mask;
}

struct ClearPairs {
  Sweep<sweep_table> sweep;

  FATHOM_HD void operator()(std::uint32_t i) const {
    for (std::uint32_t k = 0; k < 4; ++k) sweep.pairs[4 * i + k] = no_pair;
  }
};

/// Enters every contact except those that end in this step because the application changed their bodies.
struct EnterPairs {
  Bodies<> bodies;
  Contacts<> contacts;
  Sweep<sweep_table> sweep;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const Contact& c = contacts.contacts[k];
    if (!c.in_use() || c.is_patch()) return;
    const TouchingPieces pieces = pieces_of(bodies, c);
    if ((bodies.fat[pieces.a].changes | bodies.fat[pieces.b].changes) & drop_contacts) return;
    const std::uint64_t key = pair_key(pieces.a, pieces.b);
    std::uint32_t slot = pair_slot(key, sweep.pair_mask);
    while (exec::atomic_cas(sweep.pairs[slot], no_pair, key) != no_pair) slot = (slot + 1) & sweep.pair_mask;
  }
};

FATHOM_HD bool is_entered(const Sweep<>& sweep, std::uint32_t a, std::uint32_t b) {
  const std::uint64_t key = pair_key(a, b);
  for (std::uint32_t slot = pair_slot(key, sweep.pair_mask);; slot = (slot + 1) & sweep.pair_mask) {
    const std::uint64_t there = sweep.pairs[slot];
    if (there == key || there == no_pair) return there == key;
  }
}

// The sweep ------------------------------------------------------------------------------------------------------

/// One work-item per entry of the list. A wide body, such as a sea floor, would sweep over all bodies and need as many
/// slots: n × c with c = n. Wide bodies are therefore not in the list; every other body tests itself against them.
struct SweepBoxes {
  Bodies<> bodies;
  const Counters* counters;
  Sweep<sweep_overlaps, sweep_counters> sweep;

  FATHOM_HD void operator()(std::uint32_t index) const {
    const std::uint64_t mine = sweep.order[index];
    const auto i = static_cast<std::uint32_t>(mine);
    if (i >= counters->live_bodies) return;
    const NotedBox fat = bodies.fat[i];
    Found found{i, 0};
    if (fat.lower.x <= fat.upper.x) {
      const bool is_wide = mine >= absent;
      if (!is_wide) {
        const std::uint64_t last = sortable(dot(sweep.axis, fat.upper));
        for (std::uint32_t k = index + 1; k < sweep.counters->elements; ++k) {
          const std::uint64_t other = sweep.order[k];
          if (other >> 32 > last) break;
          test(found, fat, static_cast<std::uint32_t>(other));
        }
      }
      for (std::uint32_t k = 0; k < sweep.counters->wide; ++k)
        if (!is_wide || sweep.wide[k] > i) test(found, fat, sweep.wide[k]);
    }
    sweep.counts[i] = found.count;
    if (found.count > exec::atomic_load(sweep.counters->max_overlaps))
      exec::atomic_max(sweep.counters->max_overlaps, found.count);
  }

 private:
  struct Found {
    std::uint32_t body, count;
  };

  FATHOM_HD void test(Found& found, const NotedBox& fat, std::uint32_t j) const {
    if (!overlaps(fat.box(), bodies.fat[j].box())) return;
    if (found.count < sweep.slots) sweep.overlaps[static_cast<std::size_t>(found.body) * sweep.slots + found.count] = j;
    ++found.count;
  }
};

/// Adopts the overlaps that are not contacts yet, one work-group per body.
struct TakeOverlaps {
  static constexpr std::uint32_t group_size = 32;
  struct Local {};

  Bodies<> bodies;
  Contacts<contact_worklists> contacts;
  Counters* counters;
  Sweep<> sweep;

  FATHOM_HD void operator()(auto group, Local&) const {
    const std::uint32_t i = group.index();
    const std::uint32_t n = sweep.counts[i] < sweep.slots ? sweep.counts[i] : sweep.slots;
    group.for_each(n, [&](std::uint32_t k) { take(i, sweep.overlaps[static_cast<std::size_t>(i) * sweep.slots + k]); });
  }

 private:
  FATHOM_HD void take(std::uint32_t i, std::uint32_t j) const {
    if (!may_touch(bodies, i, j)) return;
    if (is_entered(sweep, i, j)) return;
    note_found(bodies, contacts, *counters, i, j);
  }
};

/// A step in which some body found more than c overlaps stops before it has changed anything, and is repeated with a
/// larger c.
struct CheckSlots {
  Counters* counters;
  Sweep<> sweep;

  FATHOM_HD void operator()(std::uint32_t) const {
    if (counters->live_bodies > 0 && sweep.counters->max_overlaps > sweep.slots) counters->stopped = 1;
  }
};

}  // namespace fathom::device
