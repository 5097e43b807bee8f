// Exclusive scan and selection, built from group kernels only, for back ends without a library.
//
// Three launches: each work-group sums its tile, one group scans the tiles' sums, each group scans its tile.
#pragma once

#include <cstdint>

#include "exec/device.hpp"
#include "exec/group.hpp"

namespace fathom::exec::portable {

inline constexpr std::uint32_t scan_group_size = 256;
inline constexpr std::uint32_t scan_items_per_work_item = 8;
inline constexpr std::uint32_t scan_tile = scan_group_size * scan_items_per_work_item;

inline std::uint32_t scan_tiles(std::uint32_t capacity) { return (capacity + scan_tile - 1) / scan_tile; }

/// One number per item of a group, and as many as working memory.
struct GroupSums {
  std::uint32_t values[scan_group_size];
  std::uint32_t other[scan_group_size];
};

/// Replaces each item's value by the sum of the values up to and including its own.
template <class Group>
FATHOM_HD void inclusive_scan(const Group& group, GroupSums& sums) {
  static_assert(Group::size == scan_group_size);
  for (std::uint32_t distance = 1; distance < scan_group_size; distance *= 2) {
    group.for_each([&](std::uint32_t item) {
      sums.other[item] = sums.values[item] + (item >= distance ? sums.values[item - distance] : 0);
    });
    group.for_each([&](std::uint32_t item) { sums.values[item] = sums.other[item]; });
  }
}

/// Load and Store are functions of an item's index: the term to sum, and where the sum before it goes.
template <class Load>
struct SumTiles {
  static constexpr std::uint32_t group_size = scan_group_size;
  using Local = GroupSums;

  Range range;
  Load load;
  std::uint32_t* tile_sums;

  FATHOM_HD void operator()(auto group, Local& local) const {
    const std::uint32_t n = range.size();
    group.for_each([&](std::uint32_t item) {
      std::uint32_t sum = 0;
      for (std::uint32_t k = 0; k < scan_items_per_work_item; ++k) {
        const std::uint32_t i = group.index() * scan_tile + k * group_size + item;
        if (i < n) sum += load(i);
      }
      local.values[item] = sum;
    });
    inclusive_scan(group, local);
    group.once([&] { tile_sums[group.index()] = local.values[group_size - 1]; });
  }
};

/// Scans the tiles' sums in place, one group's width after the other.
struct ScanTileSums {
  static constexpr std::uint32_t group_size = scan_group_size;
  struct Local {
    GroupSums sums;
    std::uint32_t carry;
  };

  std::uint32_t tiles;
  std::uint32_t* tile_sums;
  std::uint32_t* total;

  FATHOM_HD void operator()(auto group, Local& local) const {
    auto own = per_item<std::uint32_t>(group);
    group.once([&] { local.carry = 0; });
    for (std::uint32_t first = 0; first < tiles; first += group_size) {
      group.for_each([&](std::uint32_t item) {
        own[item] = first + item < tiles ? tile_sums[first + item] : 0;
        local.sums.values[item] = own[item];
      });
      inclusive_scan(group, local.sums);
      group.for_each([&](std::uint32_t item) {
        if (first + item < tiles) tile_sums[first + item] = local.carry + local.sums.values[item] - own[item];
      });
      group.once([&] { local.carry += local.sums.values[group_size - 1]; });
    }
    group.once([&] {
      if (total) *total = local.carry;
    });
  }
};

template <class Load, class Store>
struct ScanTiles {
  static constexpr std::uint32_t group_size = scan_group_size;
  using Local = GroupSums;

  Range range;
  Load load;
  Store store;
  const std::uint32_t* tile_sums;

  FATHOM_HD void operator()(auto group, Local& local) const {
    const std::uint32_t n = range.size();
    auto own = per_item<std::uint32_t>(group);
    group.for_each([&](std::uint32_t item) {  // each item's own run, so that it can be traversed in order below
      const std::uint32_t begin = group.index() * scan_tile + item * scan_items_per_work_item;
      own[item] = 0;
      for (std::uint32_t i = begin; i < begin + scan_items_per_work_item && i < n; ++i) own[item] += load(i);
      local.values[item] = own[item];
    });
    inclusive_scan(group, local);
    group.for_each([&](std::uint32_t item) {
      const std::uint32_t begin = group.index() * scan_tile + item * scan_items_per_work_item;
      std::uint32_t sum = tile_sums[group.index()] + local.values[item] - own[item];
      for (std::uint32_t i = begin; i < begin + scan_items_per_work_item && i < n; ++i) {
        const std::uint32_t term = load(i);
        store(i, sum);
        sum += term;
      }
    });
  }
};

inline std::size_t scan_scratch_bytes(std::uint32_t capacity) { return scan_tiles(capacity) * sizeof(std::uint32_t); }

template <class D, class Load, class Store>
void scan(D& device, std::byte* memory, Range range, Load load, Store store, std::uint32_t* total, const Where& where) {
  auto* const tile_sums = reinterpret_cast<std::uint32_t*>(memory);
  const std::uint32_t tiles = scan_tiles(range.capacity);
  device.parallel_groups(tiles, SumTiles<Load>{range, load, tile_sums}, where);
  device.parallel_groups(1, ScanTileSums{tiles, tile_sums, total}, where);
  device.parallel_groups(tiles, ScanTiles<Load, Store>{range, load, store, tile_sums}, where);
}

struct LoadTerm {
  const std::uint32_t* in;
  FATHOM_HD std::uint32_t operator()(std::uint32_t i) const { return in[i]; }
};
struct StoreSum {
  std::uint32_t* out;
  FATHOM_HD void operator()(std::uint32_t i, std::uint32_t sum) const { out[i] = sum; }
};

template <class D>
void exclusive_scan(D& device, Scratch& scratch, Range range, const std::uint32_t* in, std::uint32_t* out,
                    std::uint32_t* total, const Where& where) {
  std::byte* const memory = scratch.take(scan_scratch_bytes(range.capacity), where);
  scan(device, memory, range, LoadTerm{in}, StoreSum{out}, total, where);
}

struct LoadFlag {
  const std::uint32_t* flags;
  FATHOM_HD std::uint32_t operator()(std::uint32_t i) const { return flags[i] != 0; }
};
struct StoreIndex {
  const std::uint32_t* flags;
  std::uint32_t* indices;
  FATHOM_HD void operator()(std::uint32_t i, std::uint32_t index) const {
    if (flags[i] != 0) indices[index] = i;
  }
};

template <class D>
void select(D& device, Scratch& scratch, Range range, const std::uint32_t* flags, std::uint32_t* indices,
            std::uint32_t* count, const Where& where) {
  std::byte* const memory = scratch.take(scan_scratch_bytes(range.capacity), where);
  scan(device, memory, range, LoadFlag{flags}, StoreIndex{flags, indices}, count, where);
}

}  // namespace fathom::exec::portable
