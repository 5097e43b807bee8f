// find_pairs: finds pairs whose fat boxes have begun to overlap.
//
// Contacts exist exactly for the pairs whose fat boxes overlapped in the last search. So a pair is new if its boxes
// overlap now and its boxes of that search did not: no table of pairs is needed. Only bodies with new boxes search.
#pragma once

#include "device/contact_arrays.hpp"
#include "device/grid.hpp"
#include "device/pieces.hpp"
#include "device/tuning.hpp"
#include "dynamics/manifold_update.hpp"
#include "exec/atomic.hpp"
#include "exec/group.hpp"
#include "exec/kernel.hpp"

namespace fathom::device {

/// Sets up the counters of a step; nothing of a stopped step runs.
struct BeginStep {
  Counters* counters;
  std::uint32_t grid_entries;

  FATHOM_HD void operator()(std::uint32_t) const {
    Counters& c = *counters;
    const bool run = !c.stopped;
    c.live_bodies = run ? c.bodies : 0;
    const bool fills = run && (c.changed || c.filled_entries != grid_entries);
    c.grid_bodies = fills ? c.bodies : 0;
    c.search_groups = (c.grid_bodies + search_group_bodies - 1) / search_group_bodies;
    c.grid_cells = fills ? grid_entries / 4 : 0;
    // The host still has to learn what room the stopped step needs.
    if (run) c.found = c.found_with_surfaces = 0;
    c.added = c.coarse_groups = 0;
    // Obstacles of strays are searched in the grid of the last search (`HoldBackFast`).
    if (fills) {
      c.filled_entries = grid_entries;
      c.changed_levels = c.big = 0;
      c.levels = 1;
    }
    for (std::uint32_t& count : c.to_collide) count = 0;
    for (std::uint32_t k = 0; k < 2; ++k) c.looked_ahead[k] = c.fast[k];
    c.waking = run && c.wake_asked ? c.bodies : 0;
    // A step that stopped halfway resumes with these.
    if (c.stopped == no_room_for_manifolds || c.stopped == body_failed) return;
    for (std::uint32_t k = 0; k < 2; ++k) c.fast[k] = c.looked_ahead[k] = 0;
    c.fast_bodies = 0;
    for (std::uint32_t& n : c.uncoloured) n = 0;
    c.any_began = c.any_ended = 0;
    c.recycled = c.points = c.begun = c.ended = c.hits = c.quarantined = c.islands = c.active = 0;
  }
};

struct ClearGrid {
  Grid grid;

  FATHOM_HD void operator()(std::uint32_t i) const {
    for (std::uint32_t k = 0; k < 4; ++k) grid.heads[4 * i + k] = none;
  }
};

/// Puts every body into its cell.
struct FillGrid {
  Bodies<> bodies;
  Grid grid;
  Counters* counters;

  // Most bodies find the bit already set: a read is cheap, but all bodies writing one word would not be.
  FATHOM_HD static void set_once(std::uint32_t& word, std::uint32_t bit) {
    if (!(exec::atomic_load(word) & bit)) exec::atomic_or(word, bit);
  }

  FATHOM_HD void operator()(std::uint32_t i) const {
    const NotedBox fat = bodies.fat[i];
    if (!(fat.lower.x <= fat.upper.x)) return;  // no body has this index
    if (fat.level > 0) set_once(counters->levels, 1u << fat.level);
    if (fat.changes) {
      set_once(counters->changed_levels, 1u << fat.level);
      if (fat.level > 0 && exec::atomic_load(counters->coarse_groups) == 0)
        exec::atomic_store(counters->coarse_groups, (counters->bodies + search_group_bodies - 1) / search_group_bodies);
    }
    if (fat.level == big_level) {
      grid.big[exec::atomic_add(counters->big, 1u)] = i;
    } else {
      const std::uint32_t entry = grid.entry(grid.cell_of(centre(fat.box()), fat.level), fat.level);
      grid.next[i] = exec::atomic_exchange(grid.heads[entry], i);
    }
  }
};

/// Notes a pair of pieces that needs a contact.
template <class AnyBodies, class AnyContacts>
FATHOM_HD void note_found(const AnyBodies& bodies, const AnyContacts& contacts, Counters& counters, std::uint32_t i,
                          std::uint32_t j) {
  const std::uint32_t index = exec::atomic_add(counters.found, 1u);
  if (index < contacts.capacity) contacts.found[index] = {i, j};
  if (bodies.constants[i].is_surface() || bodies.constants[j].is_surface())
    exec::atomic_add(counters.found_with_surfaces, 1u);
}

/// Bodies with new boxes search their own and all coarser levels. With `coarse`, bodies without new boxes search for
/// coarser bodies with new boxes, because those do not search finer levels.
///
/// A work-group lists those of its bodies that search, then distributes their cells over its items.
template <bool coarse>
struct SearchGrid {
  static constexpr std::uint32_t group_size = 128;
  static constexpr std::uint32_t bodies_per_group = search_group_bodies;
  static constexpr std::uint32_t lanes = 32;  ///< 27 cells, and one for the big bodies
  static constexpr std::uint32_t big_lane = 27;

  struct Local {
    std::uint32_t count;
    std::uint32_t searching[bodies_per_group];
  };

  Bodies<> bodies;
  Contacts<contact_worklists> contacts;
  GridView grid;
  Counters* counters;

  FATHOM_HD void operator()(auto group, Local& local) const {
    group.once([&] { local.count = 0; });
    group.for_each(bodies_per_group, [&](std::uint32_t k) {
      const std::uint32_t i = group.index() * bodies_per_group + k;
      if (i < counters->live_bodies && searches(bodies.fat[i])) local.searching[exec::atomic_add(local.count, 1u)] = i;
    });
    const std::uint32_t n = group.broadcast(local.count);
    group.for_each(n * lanes, [&](std::uint32_t k) { search(local.searching[k / lanes], k % lanes); });
  }

 private:
  FATHOM_HD bool searches(const NotedBox& fat) const {
    if (!(fat.lower.x <= fat.upper.x)) return false;
    if constexpr (coarse)
      return fat.changes == 0 && counters->changed_levels >> fat.level >> 1 != 0;
    else
      return fat.changes != 0;
  }

  FATHOM_HD void search(std::uint32_t i, std::uint32_t lane) const {
    const NotedBox fat = bodies.fat[i];
    const std::uint32_t levels = coarse ? counters->changed_levels : counters->levels;
    if (lane == big_lane) {
      for (std::uint32_t k = 0; k < counters->big; ++k) test(i, fat, grid.big[k]);
      return;
    }
    if (lane > big_lane) return;
    const Vec3 middle = centre(fat.box());
    const Vec3 half = half_extents(fat.box());
    const float rounding = 2 * Grid::rounding(fat.box());
    for (std::uint32_t level = coarse ? fat.level + 1 : fat.level; level < grid_levels; ++level) {
      if (!(levels >> level & 1u)) continue;
      // The centre of a box that overlaps this one lies at most this far outside it.
      const float reach = 0.5f * grid.edge(level) + rounding;
      const Vec3 d = half + Vec3{reach, reach, reach};
      const Cell first = grid.cell_of(middle - d, level), last = grid.cell_of(middle + d, level);
      const Cell own = grid.cell_of(middle, level);
      const auto k = static_cast<std::int32_t>(lane);
      const Cell cell{own.x + k % 3 - 1, own.y + k / 3 % 3 - 1, own.z + k / 9 - 1};
      if (cell.x < first.x || cell.y < first.y || cell.z < first.z || cell.x > last.x || cell.y > last.y ||
          cell.z > last.z)
        continue;
      for (std::uint32_t j = grid.heads[grid.entry(cell, level)]; j != none; j = grid.next[j]) {
        const NotedBox other = bodies.fat[j];
        // Other cells or levels may share the table entry.
        if (!overlaps(fat.box(), other.box()) || other.level != level) continue;
        if (grid.cell_of(centre(other.box()), level) == cell) take(i, fat, j, other);
      }
    }
  }

  FATHOM_HD void test(std::uint32_t i, const NotedBox& fat, std::uint32_t j) const {
    const NotedBox other = bodies.fat[j];
    if (overlaps(fat.box(), other.box())) take(i, fat, j, other);
  }

  FATHOM_HD void take(std::uint32_t i, const NotedBox& fat, std::uint32_t j, const NotedBox& other) const {
    if (i == j) return;
    if constexpr (coarse) {
      if (!other.changes || other.level <= fat.level) return;
    } else {
      if (other.changes && other.level == fat.level && j < i) return;  // j finds it
    }
    if (overlaps(bodies.known[i].box(), bodies.known[j].box())) return;  // they already have a contact
    if (may_touch(bodies, i, j)) note_found(bodies, contacts, *counters, i, j);
  }
};

/// Whether all contacts choose new colours in this step.
FATHOM_HD bool wants_recolouring(const Counters& c) {
  return c.recolour_trials > 0 && c.step % 4 == 0 && c.dynamic_sweeps > 1;
}

/// Allots slots to new contacts, or stops the step if there is no room for them.
struct AllotPairs {
  Counters* counters;
  std::uint32_t capacity;
  std::uint32_t contact_group_size;

  FATHOM_HD void operator()(std::uint32_t) const {
    Counters& c = *counters;
    c.recycling = c.free_contacts;
    c.first_new = c.contacts;
    const std::uint32_t patches = patches_per_pair * c.found_with_surfaces, slots = c.found + patches;
    const std::uint32_t reused = slots < c.free_contacts ? slots : c.free_contacts;
    if (c.stopped || slots - reused > capacity - c.contacts) {
      if (!c.stopped) c.stopped = no_room_for_pairs;
      c.live_bodies = c.live_contacts = c.contact_groups = c.added = c.recolouring = 0;
      return;
    }
    c.added = c.found;
    c.patches += patches;
    c.patch_slots_taken = 0;
    c.free_contacts -= reused;
    c.contacts += slots - reused;
    c.live_contacts = c.contacts;
    c.contact_groups = (c.contacts + contact_group_size - 1) / contact_group_size;
    c.changed = c.wake_asked = 0;
    c.recolouring = wants_recolouring(c);
    if (c.recolouring) c.layout_dirty = 1;
  }
};

struct AddContacts {
  Bodies<> bodies;
  Contacts<contact_list> contacts;
  Counters* counters;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const std::uint32_t index = slot(k);
    const PairRecord pair = contacts.found[k];
    std::uint32_t piece_a = pair.a, piece_b = pair.b;
    const std::uint32_t body_a = body_of(bodies, piece_a), body_b = body_of(bodies, piece_b);
    // The lower index is A, unless that leaves B unable to move.
    const bool is_a_first = body_a < body_b;
    const bool is_b_dynamic = bodies.constants[is_a_first ? body_b : body_a].is_dynamic();
    Contact c;
    c.a = body_a, c.b = body_b;
    if (is_a_first != is_b_dynamic) {
      c.a = body_b, c.b = body_a;
      piece_a = pair.b, piece_b = pair.a;
    }
    c.bits = overflow_colour | fresh_bit | (bodies.constants[c.a].is_dynamic() ? 0u : fixed_a_bit);
    const BodyConstants &first = bodies.constants[piece_a], &second = bodies.constants[piece_b];
    if (first.is_child() || second.is_child()) {
      c.bits |= in_parts_bit;
      c.children = child_of(bodies, piece_a) << 16 | child_of(bodies, piece_b);
    }
    c.bits |= touch_halvings(min(bodies.constants[c.a].radius, bodies.constants[c.b].radius)) << touch_halvings_shift;
    c.recycle_distance = recycle_distance(first.shape(), first.radius, second.shape(), second.radius);
    if (first.is_surface()) add_patches(c);
    contacts.contacts[index] = c;
  }

 private:
  /// The k-th slot of those that this step's pairs take.
  FATHOM_HD std::uint32_t slot(std::uint32_t k) const {
    const std::uint32_t recycling = counters->recycling;
    return k < recycling ? contacts.free[recycling - 1 - k] : counters->first_new + (k - recycling);
  }
  /// A pair with a surface keeps a contact for each patch in which it may touch, linked from it.
  FATHOM_HD void add_patches(Contact& pair) const {
    constexpr std::uint32_t count = patches_per_pair;
    const std::uint32_t first = counters->found + exec::atomic_add(counters->patch_slots_taken, count);
    pair.bits |= with_surface_bit;
    Contact patch = pair;
    patch.bits = (pair.bits & ~(with_surface_bit | fresh_bit)) | patch_bit;
    for (std::uint32_t p = 0; p < count; ++p) {
      patch.children = p << 16 | pair.child_b();
      patch.set_next_patch(p + 1 < count ? slot(first + p + 1) : none);
      contacts.contacts[slot(first + p)] = patch;
    }
    pair.manifold = slot(first);
  }
};

}  // namespace fathom::device
