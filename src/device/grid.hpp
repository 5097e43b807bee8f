// A hashed uniform grid of several levels, for the broad phase.
//
// A body lies in the one cell that contains the centre of its fat box, on the finest level whose cells are at least as
// large as the box. Boxes can therefore overlap only if their centres lie at most one cell apart on the coarser one's
// level. Levels double in size. Boxes beyond the last level are "big" and tested one by one: there are few. A cell is a
// list that bodies enter by exchanging its head. Its order depends on timing, the pairs found do not.
//
// Advantage over a Morton-sorted hierarchy: no sort (53 µs for 10,000 keys, docs/execution.md), only two short kernels.
#pragma once

#include <cstdint>

#include "device/body_arrays.hpp"

namespace fathom::device {

inline constexpr std::uint32_t grid_levels = 10;
inline constexpr std::uint32_t big_level = grid_levels;

struct Cell {
  std::int32_t x, y, z;

  FATHOM_HD bool operator==(const Cell& o) const { return x == o.x && y == o.y && z == o.z; }
};

/// Edge (m) of the finest cells: that of the fat box of a body with this bounding radius (m) that turns in place.
inline float grid_base(float typical_radius) { return 2.3f * typical_radius + min(0.1f, typical_radius); }

/// The grid's only part (access.hpp).
enum GridPart : std::uint8_t { grid_table };

template <GridPart... written>
struct GridOf {
  using Entries = Array<std::uint32_t, grid_table, written...>;

  float base = 1;          ///< edge of the finest cells (m)
  std::uint32_t mask = 0;  ///< number of table entries − 1, a power of two
  Entries heads = nullptr;
  Entries next = nullptr;  ///< the body after this one in its cell
  Entries big = nullptr;   ///< bodies beyond the last level

  template <GridPart... fewer>
  FATHOM_HD operator GridOf<fewer...>() const {
    static_assert((is_among<fewer, written...> && ...));
    return __builtin_bit_cast(GridOf<fewer...>, *this);
  }

  FATHOM_HD float edge(std::uint32_t level) const { return base * static_cast<float>(1u << level); }

  /// Allows for the rounding of centres: those of overlapping boxes must never appear two cells apart.
  FATHOM_HD std::uint32_t level_of(const Aabb& box) const {
    const float extent = 1.01f * max_component(box.upper - box.lower) + 4 * rounding(box);
    std::uint32_t level = 0;
    while (level < grid_levels && !(extent <= edge(level))) ++level;
    return level;
  }

  /// Bound on the rounding error of a centre (m).
  FATHOM_HD static float rounding(const Aabb& box) {
    return 1e-6f * max_component(max(abs(box.lower), abs(box.upper)));
  }

  /// Far outside, cells are arbitrary; it only matters that every target rounds alike.
  FATHOM_HD static std::int32_t coordinate(float x, float inverse_edge) {
    return static_cast<std::int32_t>(__builtin_floorf(clamp(x * inverse_edge, -1e9f, 1e9f)));
  }
  FATHOM_HD Cell cell_of(Vec3 point, std::uint32_t level) const {
    const float inverse = 1.0f / edge(level);
    return {coordinate(point.x, inverse), coordinate(point.y, inverse), coordinate(point.z, inverse)};
  }

  /// Blocks of 4³ neighbouring cells stay together in the table; the blocks are scattered.
  FATHOM_HD std::uint32_t entry(Cell c, std::uint32_t level) const {
    const auto x = static_cast<std::uint32_t>(c.x), y = static_cast<std::uint32_t>(c.y),
               z = static_cast<std::uint32_t>(c.z);
    std::uint32_t h = (x >> 2) * 73856093u ^ (y >> 2) * 19349663u ^ (z >> 2) * 83492791u ^ level * 2654435761u;
    h ^= h >> 15;
    h *= 2246822519u;
    h ^= h >> 13;
    return (h << 6 | (x & 3u) | (y & 3u) << 2 | (z & 3u) << 4) & mask;
  }
};

using Grid = GridOf<grid_table>;
using GridView = GridOf<>;

}  // namespace fathom::device
