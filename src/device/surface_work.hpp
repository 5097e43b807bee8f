// Working memory of the collision with surfaces.
#pragma once

#include "device/contact_arrays.hpp"
#include "device/tuning.hpp"
#include "terrain/surface_collision.hpp"

namespace fathom::device {

static_assert(patches_per_pair == max_surface_manifolds);

/// A pair with a surface that has to collide.
struct SurfaceTask {
  std::uint32_t pair;  ///< its contact; `none`: it is left to a team
  std::uint32_t surface;
  std::uint32_t is_round;  ///< what touches the surface is a round shape
  std::uint32_t earliest;  ///< s from the step's beginning to the first deep impact, the bits of a float ≥ 0
  std::uint32_t is_clear;  ///< no triangle is near, nor on the way
  Aabb box;                ///< around the way of b, then around b at `b_in_a` (m, the surface's frame)
  // Of its entries.
  std::uint32_t first, count;
  float margin;  ///< m
  Pose b_in_a;   ///< at which it is to be collided
  float time;    ///< s from the step's beginning to there; below zero: as the bodies are
  Tolerance tolerance;
  int pushes;                     ///< of the last step
  Vec3 pushed[patches_per_pair];  ///< their normals, in the shape's axes
};

/// A triangle that a task has to do with.
struct SurfaceEntry {
  std::uint32_t task;  ///< `none`: nothing to do
  std::uint32_t number;
  std::uint32_t touch;  ///< `none`: they do not touch; `no_room`: it is not known
};
inline constexpr std::uint32_t no_room = none - 1;

/// Lists of entries: triangles that fast pairs may run into, and those near round shapes and near all others.
enum EntryList : std::uint32_t { on_way, near_round, near_polyhedra };
inline constexpr std::uint32_t entry_lists = 3;

struct SurfaceCounts {
  std::uint32_t tasks, fast, entries[entry_lists], touches;
  std::uint32_t left;  ///< pairs that find no room in the lists, and are left to teams
};

/// What a team's work-items touch, each with one triangle.
struct TeamTouches {
  SurfaceTouch touches[team::size];
};

/// Memory in one piece.
struct SurfaceWork {
  TeamTouches* teams;
  std::uint32_t team_count;  ///< 0: there are no surfaces
  std::byte* arrays;
  std::uint32_t capacity;  ///< pairs

  static constexpr std::size_t bytes_per_pair = sizeof(SurfaceTask) + 2 * sizeof(std::uint32_t) +
                                                entry_lists * surface_entries_per_pair * sizeof(SurfaceEntry) +
                                                surface_touches_per_pair * sizeof(SurfaceTouch);
  static constexpr std::size_t padding = 256;  ///< the counts, and what aligns arrays
  static std::size_t bytes(std::size_t pairs) { return padding + pairs * bytes_per_pair; }
};

/// The arrays, for kernels.
struct SurfaceArrays {
  SurfaceCounts* counts;
  SurfaceTask* tasks;
  SurfaceEntry* entries;
  SurfaceTouch* touches;
  std::uint32_t* left;
  std::uint32_t* fast;  ///< tasks
  std::uint32_t capacity, entry_capacity, touch_capacity;

  explicit SurfaceArrays(const SurfaceWork& work)
      : capacity(work.capacity),
        entry_capacity(static_cast<std::uint32_t>(capacity * surface_entries_per_pair)),
        touch_capacity(static_cast<std::uint32_t>(capacity * surface_touches_per_pair)) {
    std::byte* next = work.arrays;
    const auto take = [&]<class T>(T*& array, std::size_t size) {
      array = reinterpret_cast<T*>(next);
      next += (size * sizeof(T) + 15) / 16 * 16;
    };
    take(counts, 1);
    take(tasks, capacity);
    take(entries, entry_lists * std::size_t{entry_capacity});
    take(touches, touch_capacity);
    take(left, capacity);
    take(fast, capacity);
  }
  FATHOM_HD SurfaceEntry* list(EntryList k) const { return entries + std::size_t{k} * entry_capacity; }
};

}  // namespace fathom::device
