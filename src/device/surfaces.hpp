// Meshes and height fields on the device. A surface touches a body in patches, one for each contact direction
// (terrain/surface_patch.hpp), and a pair with a surface has a contact for each: they are made with the pair, linked
// from it, and solved like any other contact. The pair's own contact never touches.
//
// Most pairs meet few triangles and touch one, so a kernel for whole pairs would mostly wait. Instead, tasks and lists
// of triangles go from kernel to kernel, each of which does one thing, and a work-item per pair puts the touches
// together. Pairs that find no room in the lists are collided whole by teams (math/team.hpp), to the same bits.
#pragma once

#include "device/surface_tasks.hpp"
#include "exec/device.hpp"

namespace fathom::device {

/// Puts the touches of tasks together. A pair that would begin to touch but finds no room for its manifolds is left
/// unchanged and deferred.
struct JoinTouches {
  static constexpr std::uint32_t group_size = 32;

  PairsOnSurfaces pairs;
  SurfaceArrays arrays;

  FATHOM_HD void operator()(std::uint32_t k) const {
    SurfaceTask& task = arrays.tasks[k];
    if (task.pair == none) return;
    SurfaceEntry* const entries = arrays.list(task.is_round ? near_round : near_polyhedra) + task.first;
    std::uint32_t count = 0;  // of entries that touch; they move to the front
    for (std::uint32_t e = 0; e < task.count; ++e) {
      const std::uint32_t touch = entries[e].touch;
      if (touch == no_room) return leave_to_team(arrays, task);
      if (touch != none) entries[count++].touch = touch;
    }
    const auto& bodies = pairs.changes.bodies;
    const Contact pair = pairs.changes.contacts.contacts[task.pair];
    const TrianglesAround around{bodies.surfaces[task.surface], task.b_in_a, task.box};
    const auto for_each_touch = [&](const auto& act) {
      for (std::uint32_t e = 0; e < count; ++e) act(arrays.touches[entries[e].touch]);
    };
    pairs.take(task.pair, pair, pieces_of(bodies, pair), pairs.patches_of(pair), for_each_touch, around, task.tolerance,
               task.time, true);
  }
};

/// Collides the pairs that are left, each by a team.
struct CollideSurfaces {
  static constexpr std::uint32_t group_size = 64;
  static constexpr bool runs_in_teams = true;

  PairsOnSurfaces pairs;
  SurfaceArrays arrays;
  TeamTouches* teams;
  std::uint32_t team_count;

  FATHOM_HD void operator()(std::uint32_t team) const {
    for (std::uint32_t k = team; k < arrays.counts->left; k += team_count) collide(arrays.left[k], teams[team]);
  }

 private:
  FATHOM_HD void collide(std::uint32_t index, TeamTouches& memory) const {
    const ContactChanges& changes = pairs.changes;
    const Contact pair = changes.contacts.contacts[index];
    const TouchingPieces pieces = pieces_of(changes.bodies, pair);
    const PairsOnSurfaces::Patches patches = pairs.patches_of(pair);
    const PairMotion motion(changes.bodies, pieces, pairs.dt);
    const SurfaceAhead ahead = motion.is_fast ? look_ahead(motion) : SurfaceAhead{motion.b_in_a};
    const float margin = motion.margin(ahead);
    Vec3 pushed[patches_per_pair];
    for (int i = 0; i < patches.push_count; ++i)
      pushed[i] = inverse_rotate(ahead.b_in_a.rotation, patches.pushes[i].normal);
    const ShapeInOwnAxes<ShapeKind::any> shape(motion.b.geometry);
    const Tolerance tolerance = make_tolerance(shape.inner(), shape.outer());
    const TrianglesAround around{motion.surface, ahead.b_in_a, grown(bounds(motion.b.geometry, ahead.b_in_a), margin)};
    // There is no room for all touches, so they are found again whenever they are needed.
    const auto for_each_touch = [&](const auto& act) {
      if (ahead.is_clear) return;
      for_each_by_team(
          motion.surface, around.box,
          [&](std::uint32_t number) {
            memory.touches[team::item()] =
                touch_of(number, around, shape, margin, pushed, patches.push_count, tolerance);
          },
          [&](std::uint32_t count) {
            for (std::uint32_t k = 0; k < count; ++k)
              if (memory.touches[k].touches) act(memory.touches[k]);
          });
    };
    pairs.take(index, pair, pieces, patches, for_each_touch, around, tolerance, ahead.time, team::is_leader());
    team::sync();
  }

  FATHOM_HD SurfaceAhead look_ahead(const PairMotion& motion) const {
    float earliest = PairMotion::never;
    bool is_clear = true;
    for_each_by_team(
        motion.surface, motion.box_of_way(),
        [&](std::uint32_t number) { earliest = min(earliest, motion.impact(number)); },
        [&](std::uint32_t) { is_clear = false; });
    for (int bits = 1; bits < static_cast<int>(team::items); bits *= 2)
      earliest = min(earliest, team::from_item_xor(earliest, bits));
    return motion.ahead(earliest, is_clear);
  }
};

/// Collides the pairs with surfaces that `SortOutContacts` has listed. Compiled apart from the rest of the step,
/// because its kernels take long to compile.
template <exec::Device D>
void collide_surfaces(D& device, const ContactChanges& changes, const SurfaceWork& work, float dt) {
  const PairsOnSurfaces pairs{changes, dt};
  const SurfaceArrays arrays(work);
  const auto entries = [&](EntryList k) { return exec::Range{&arrays.counts->entries[k], arrays.entry_capacity}; };
  const exec::Range tasks{&arrays.counts->tasks, arrays.capacity};
  device.zero(arrays.counts, 1);
  device.parallel_for({&changes.counters->to_collide[surfaces], arrays.capacity}, SortOutSurfaces{pairs, arrays});
  device.parallel_for({&arrays.counts->fast, arrays.capacity}, FindWays{pairs, arrays});
  device.parallel_for(entries(on_way), MeetTriangles{pairs, arrays});
  device.parallel_for(tasks, PrepareTasks{pairs, arrays});
  device.parallel_for(tasks, FindTriangles{pairs, arrays});
  device.parallel_for(entries(near_round), TouchTriangles<ShapeKind::round>{pairs, arrays});
  device.parallel_for(entries(near_polyhedra), TouchTriangles<ShapeKind::polyhedron>{pairs, arrays});
  device.parallel_for(tasks, JoinTouches{pairs, arrays});
  // A count of items beyond that of teams is clamped.
  device.parallel_for({&arrays.counts->left, work.team_count},
                      CollideSurfaces{pairs, arrays, work.teams, work.team_count});
}

}  // namespace fathom::device
