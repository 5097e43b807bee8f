// Tasks: pairs with a surface that have to collide, and the triangles that each has to do with (surfaces.hpp).
#pragma once

#include "device/surface_pairs.hpp"
#include "device/surface_work.hpp"

namespace fathom::device {

FATHOM_HD void leave_to_team(const SurfaceArrays& arrays, SurfaceTask& task) {
  arrays.left[exec::atomic_add(arrays.counts->left, 1u)] = task.pair;
  task.pair = none;
}

/// Lists the triangles in the box for a task; called by a whole team. Returns the range of their entries, whose
/// beginning is `no_room` if there is none.
FATHOM_HD Stretch list_triangles(const SurfaceArrays& arrays, std::uint32_t task, const SurfaceView& surface,
                                 const Aabb& box, EntryList list) {
  constexpr std::uint32_t rounds_at_once = team::items > 1 ? 8 : 64;
  std::uint32_t numbers[rounds_at_once], rounds = 0, count = 0;  // of this work-item
  for_each_by_team(
      surface, box,
      [&](std::uint32_t number) {
        if (rounds < rounds_at_once) numbers[rounds] = number;
      },
      [&](std::uint32_t n) { ++rounds, count += n; });
  if (count == 0) return {0, 0};
  std::uint32_t first = 0;
  if (team::is_leader()) first = exec::atomic_add(arrays.counts->entries[list], count);
  first = team::from_item(first, 0);
  SurfaceEntry* const entries = arrays.list(list);
  if (first + count > arrays.entry_capacity) {
    for (std::uint32_t k = first + team::item(); k < arrays.entry_capacity; k += team::items) entries[k].task = none;
    return {no_room, count};
  }
  std::uint32_t k = first + team::item();
  if (rounds <= rounds_at_once) {
    for (std::uint32_t r = 0; r < rounds; ++r, k += team::items)
      if (k < first + count) entries[k] = {task, numbers[r], none};
    return {first, count};
  }
  for_each_by_team(
      surface, box,
      [&](std::uint32_t number) {
        entries[k] = {task, number, none};
      },
      [&](std::uint32_t) { k += team::items; });
  return {first, count};
}

/// Sorts out the pairs that have moved little since their patches were made. The others become tasks.
struct SortOutSurfaces {
  static constexpr std::uint32_t group_size = 32;  // few items

  PairsOnSurfaces pairs;
  SurfaceArrays arrays;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const ContactChanges& changes = pairs.changes;
    const std::uint32_t index = changes.contacts.to_collide[changes.contacts.listed(surfaces, k)];
    const Contact pair = changes.contacts.contacts[index];
    const TouchingPieces pieces = pieces_of(changes.bodies, pair);
    if (is_recycled(pair, pieces)) {
      exec::atomic_add(changes.counters->recycled, 1u);
      changes.for_each_patch(pair, [&](std::uint32_t p, const Contact& patch) {
        if (patch.touching()) pairs.colour_if_needed(p);
      });
      return pairs.watch(index, pair);
    }
    const std::uint32_t number = exec::atomic_add(arrays.counts->tasks, 1u);
    SurfaceTask& task = arrays.tasks[number];
    const PairMotion motion(changes.bodies, pieces, pairs.dt);
    task.pair = index;
    task.surface = changes.bodies.constants[pieces.a].hull;
    task.is_round = is_round(motion.b.geometry);
    task.is_clear = 0;
    task.earliest = __builtin_bit_cast(std::uint32_t, PairMotion::never);
    if (!motion.is_fast) return;
    task.box = motion.box_of_way();
    arrays.fast[exec::atomic_add(arrays.counts->fast, 1u)] = number;
  }

 private:
  FATHOM_HD bool is_recycled(const Contact& pair, const TouchingPieces& pieces) const {
    const auto& bodies = pairs.changes.bodies;
    const BodyConstants &a = bodies.constants[pieces.a], &b = bodies.constants[pieces.b];
    const Pose b_in_a = relative(bodies.poses[pair.a], bodies.poses[pair.b]);
    const float distance = recycle_distance(a.shape(), a.radius, b.shape(), b.radius);
    bool touches = false, moved = false;
    pairs.changes.for_each_patch(pair, [&](std::uint32_t, Contact& patch) {
      if (!patch.touching()) return;
      const ContactManifold& m = pairs.changes.contacts.manifolds[patch.manifold];
      touches = true;
      moved |= patch.ahead() || !moved_little(m, b_in_a, distance) || is_to_reduce_anew(patch.axis, m);
    });
    return touches && !moved;
  }
};

/// Lists the triangles on the ways of fast pairs.
struct FindWays {
  static constexpr std::uint32_t group_size = 64;
  static constexpr bool runs_in_teams = true;

  PairsOnSurfaces pairs;
  SurfaceArrays arrays;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const std::uint32_t number = arrays.fast[k];
    SurfaceTask& task = arrays.tasks[number];
    const Stretch entries =
        list_triangles(arrays, number, pairs.changes.bodies.surfaces[task.surface], task.box, on_way);
    team::sync();
    if (!team::is_leader()) return;
    task.is_clear = entries.count == 0;
    if (entries.first == no_room) leave_to_team(arrays, task);
  }
};

/// The first impact of fast pairs that gets deep within the step (dynamics/triangle_ahead.hpp).
struct MeetTriangles {
  static constexpr std::uint32_t group_size = 64;

  PairsOnSurfaces pairs;
  SurfaceArrays arrays;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const SurfaceEntry entry = arrays.list(on_way)[k];
    if (entry.task == none) return;
    SurfaceTask& task = arrays.tasks[entry.task];
    const auto& changes = pairs.changes;
    const PairMotion motion(changes.bodies, pieces_of(changes.bodies, changes.contacts.contacts[task.pair]), pairs.dt);
    if (const float time = motion.impact(entry.number); time < PairMotion::never)
      exec::atomic_min(task.earliest, __builtin_bit_cast(std::uint32_t, max(time, 0.0f)));
  }
};

/// Where tasks are to be collided.
struct PrepareTasks {
  static constexpr std::uint32_t group_size = 32;

  PairsOnSurfaces pairs;
  SurfaceArrays arrays;

  FATHOM_HD void operator()(std::uint32_t k) const {
    SurfaceTask& task = arrays.tasks[k];
    if (task.pair == none) return;
    const ContactChanges& changes = pairs.changes;
    const Contact pair = changes.contacts.contacts[task.pair];
    const PairMotion motion(changes.bodies, pieces_of(changes.bodies, pair), pairs.dt);
    const SurfaceAhead ahead = motion.ahead(__builtin_bit_cast(float, task.earliest), task.is_clear);
    task.margin = motion.margin(ahead);
    task.b_in_a = ahead.b_in_a;
    task.time = ahead.time;
    task.box = grown(bounds(motion.b.geometry, ahead.b_in_a), task.margin);
    task.first = task.count = 0;
    if (ahead.is_clear) return;
    const ShapeInOwnAxes<ShapeKind::any> shape(motion.b.geometry);
    task.tolerance = make_tolerance(shape.inner(), shape.outer());
    int pushes = 0;
    changes.for_each_patch(pair, [&](std::uint32_t, const Contact& patch) {
      if (patch.touching())
        task.pushed[pushes++] =
            inverse_rotate(ahead.b_in_a.rotation, changes.contacts.manifolds[patch.manifold].normal);
    });
    task.pushes = pushes;
  }
};

/// The triangles near tasks.
struct FindTriangles {
  static constexpr std::uint32_t group_size = 64;
  static constexpr bool runs_in_teams = true;

  PairsOnSurfaces pairs;
  SurfaceArrays arrays;

  FATHOM_HD void operator()(std::uint32_t k) const {
    SurfaceTask& task = arrays.tasks[k];
    if (task.pair == none || task.is_clear) return;
    const Stretch entries = list_triangles(arrays, k, pairs.changes.bodies.surfaces[task.surface], task.box,
                                           task.is_round ? near_round : near_polyhedra);
    team::sync();
    if (!team::is_leader()) return;
    task.first = entries.first, task.count = entries.count;
    if (entries.first == no_room) leave_to_team(arrays, task);
  }
};

/// The touches of tasks with their triangles.
template <ShapeKind kind>
struct TouchTriangles {
  static constexpr std::uint32_t group_size = 64;
  static constexpr EntryList list = kind == ShapeKind::round ? near_round : near_polyhedra;

  PairsOnSurfaces pairs;
  SurfaceArrays arrays;

  FATHOM_HD void operator()(std::uint32_t k) const {
    SurfaceEntry& entry = arrays.list(list)[k];
    if (entry.task == none) return;
    const SurfaceTask& task = arrays.tasks[entry.task];
    const auto& bodies = pairs.changes.bodies;
    const std::uint32_t b = pieces_of(bodies, pairs.changes.contacts.contacts[task.pair]).b;
    const ShapeInOwnAxes<kind> shape(bodies.geometry(b));
    const TrianglesAround around{bodies.surfaces[task.surface], task.b_in_a, task.box};
    const SurfaceTouch touch =
        touch_of(entry.number, around, shape, task.margin, task.pushed, task.pushes, task.tolerance);
    if (!touch.touches) return;
    const std::uint32_t at = exec::atomic_add(arrays.counts->touches, 1u);
    entry.touch = at < arrays.touch_capacity ? at : no_room;
    if (at < arrays.touch_capacity) arrays.touches[at] = touch;
  }
};

}  // namespace fathom::device
