// Random heaps: bodies of mixed shape, size, slenderness and density that fall into a bin.
#pragma once

#include <cstdint>
#include <optional>

#include "scene/scene.hpp"

namespace fathom {

enum class HeapKind : std::uint8_t {
  bin,            ///< a level floor
  slope,          ///< a tilted floor; sliding bodies end at the lowest wall
  sliding_floor,  ///< kinematic, moves sideways under the walls
  turning_floor,  ///< kinematic, turns about the vertical
  stream,         ///< bodies leave and return continually
};
const char* name_of(HeapKind kind);

/// Uneven ground on a heap's floor.
struct HeapSurface {
  std::size_t body = 0;  ///< in the heap's scene
  double cell = 0;       ///< width of its cells, relative to the largest body's extent
  double height = 0;     ///< bound of its range of heights, relative to the same
};

struct Heap {
  Scene scene;  ///< body 0 is the floor, 1 to 4 are the walls
  HeapKind kind = HeapKind::bin;
  float floor_half_height = 0;  ///< of the floor's box (m)
  float half_width = 0;         ///< of the bin, inside: |x| and |y| (m)
  float rim = 0;                ///< height of the walls (m)
  float lowest = 0;             ///< height of the floor's lowest point in the bin (m)
  bool has_restitution = false;
  bool has_damping = false;
  double largest = 0;  ///< extent of the largest body (m)
  double size_ratio = 1, slenderness = 1, density_ratio = 1;
  double largest_restitution = 0;
  /// Times are multiples of it (s): a heap L times as large falls and settles √L times as slowly. 1 up to 1 m.
  double time_unit = 1;
  std::optional<HeapSurface> surface;

  /// Whether the floor is at rest and no body comes or goes.
  bool is_at_rest_in_the_end() const { return kind == HeapKind::bin || kind == HeapKind::slope; }
};

/// The heap of a seed, which determines everything: 30 to 300 bodies from 5 mm to 50 m, Δt from 1/240 to 1/30 s, 2 to 8
/// substeps; the same on every machine.
Heap make_heap(std::uint64_t seed);

/// The same bodies in the same bin, but on a triangle mesh or a height field: waves or hills, with cells of 0.05 to 0.6
/// of the largest body. Sliding floors stand still.
Heap make_surface_heap(std::uint64_t seed);

/// The same bodies in the same bin, some joined to neighbours, in chains of up to 12 and trees of up to 9, by joints of
/// every type with and without limits. No motors or springs, and no mass ratios beyond 1:100. No body comes or goes.
Heap make_joint_heap(std::uint64_t seed);

/// One line of text that characterises the heap.
std::string describe(const Heap& heap);

}  // namespace fathom
