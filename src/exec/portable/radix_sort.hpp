// Stable sort by key, built from group kernels only, for back ends without a library.
//
// Four bits at a time, from the lowest: each work-group counts the digits of its tile, a scan over all groups' counts
// gives each digit of each tile its index, and each group moves its tile there. A work-item counts and moves a run of
// consecutive items in order, so the sort is stable.
#pragma once

#include <cstdint>
#include <utility>

#include "exec/portable/scan.hpp"

namespace fathom::exec::portable {

inline constexpr int digit_bits = 4;
inline constexpr std::uint32_t digits = 1u << digit_bits;
inline constexpr std::uint32_t sort_run = 8;
inline constexpr std::uint32_t sort_tile = scan_group_size * sort_run;

template <class Key>
struct Pairs {
  Key* keys;
  std::uint32_t* values;
};

struct Digit {
  int shift;
  std::uint32_t mask;
  template <class Key>
  FATHOM_HD std::uint32_t of(Key key) const {
    return static_cast<std::uint32_t>(key >> shift) & mask;
  }
};

/// Number of occurrences of each digit in each work-item's run: 16 rows with one number per item.
struct DigitCounts {
  std::uint32_t of[digits][scan_group_size];
  GroupSums sums;
};

template <class Key, class Group>
FATHOM_HD void count_runs(const Group& group, DigitCounts& counts, Digit digit, const Key* keys, std::uint32_t n) {
  group.for_each([&](std::uint32_t item) {
    for (std::uint32_t d = 0; d < digits; ++d) counts.of[d][item] = 0;
    const std::uint32_t begin = group.index() * sort_tile + item * sort_run;
    for (std::uint32_t i = begin; i < begin + sort_run && i < n; ++i) ++counts.of[digit.of(keys[i])][item];
  });
}

/// tile_counts[digit · tiles + tile]: scanned in this order they become indices.
template <class Key>
struct CountDigits {
  static constexpr std::uint32_t group_size = scan_group_size;
  using Local = DigitCounts;

  Range range;
  Digit digit;
  const Key* keys;
  std::uint32_t tiles;
  std::uint32_t* tile_counts;

  FATHOM_HD void operator()(auto group, Local& local) const {
    count_runs(group, local, digit, keys, range.size());
    group.for_each(digits, [&](std::uint32_t d) {
      std::uint32_t sum = 0;
      for (std::uint32_t item = 0; item < group_size; ++item) sum += local.of[d][item];
      tile_counts[d * tiles + group.index()] = sum;
    });
  }
};

template <class Key>
struct MoveItems {
  static constexpr std::uint32_t group_size = scan_group_size;
  using Local = DigitCounts;

  Range range;
  Digit digit;
  Pairs<Key> from;
  Pairs<Key> to;
  std::uint32_t tiles;
  const std::uint32_t* first_indices;  // of the first item of each digit in each tile

  FATHOM_HD void operator()(auto group, Local& local) const {
    const std::uint32_t n = range.size();
    count_runs(group, local, digit, from.keys, n);
    auto own = per_item<std::uint32_t>(group);
    for (std::uint32_t d = 0; d < digits; ++d) {
      group.for_each([&](std::uint32_t item) {
        own[item] = local.of[d][item];
        local.sums.values[item] = own[item];
      });
      inclusive_scan(group, local.sums);
      group.for_each([&](std::uint32_t item) {
        local.of[d][item] = first_indices[d * tiles + group.index()] + local.sums.values[item] - own[item];
      });
    }
    group.for_each([&](std::uint32_t item) {
      const std::uint32_t begin = group.index() * sort_tile + item * sort_run;
      for (std::uint32_t i = begin; i < begin + sort_run && i < n; ++i) {
        const std::uint32_t index = local.of[digit.of(from.keys[i])][item]++;
        to.keys[index] = from.keys[i];
        to.values[index] = from.values[i];
      }
    });
  }
};

template <class Key>
struct MoveBack {
  Pairs<Key> from;
  Pairs<Key> to;
  FATHOM_HD void operator()(std::uint32_t i) const {
    to.keys[i] = from.keys[i];
    to.values[i] = from.values[i];
  }
};

template <class Key>
struct SortScratch {
  std::uint32_t tiles;
  Pairs<Key> other;
  std::uint32_t* tile_counts;
  std::byte* scan;
  std::size_t bytes;

  SortScratch(std::byte* memory, std::uint32_t capacity) : tiles((capacity + sort_tile - 1) / sort_tile) {
    ScratchCutter cutter(memory);
    other.keys = cutter.cut<Key>(capacity);
    other.values = cutter.cut<std::uint32_t>(capacity);
    tile_counts = cutter.cut<std::uint32_t>(std::size_t{digits} * tiles);
    scan = cutter.cut<std::byte>(scan_scratch_bytes(digits * tiles));
    bytes = cutter.used();
  }
};

template <class D, class Key>
void sort_by_key(D& device, Scratch& scratch, Range range, Key* keys, std::uint32_t* values, int key_bits,
                 const Where& where) {
  const SortScratch<Key> half(scratch.take(SortScratch<Key>(nullptr, range.capacity).bytes, where), range.capacity);
  Pairs<Key> from{keys, values}, to = half.other;
  for (int shift = 0; shift < key_bits; shift += digit_bits) {
    const int bits = key_bits - shift < digit_bits ? key_bits - shift : digit_bits;
    const Digit digit{shift, (1u << bits) - 1};
    device.parallel_groups(half.tiles, CountDigits<Key>{range, digit, from.keys, half.tiles, half.tile_counts}, where);
    scan(device, half.scan, digits * half.tiles, LoadTerm{half.tile_counts}, StoreSum{half.tile_counts}, nullptr,
         where);
    device.parallel_groups(half.tiles, MoveItems<Key>{range, digit, from, to, half.tiles, half.tile_counts}, where);
    std::swap(from, to);
  }
  if (from.keys != keys) device.parallel_for(range, MoveBack<Key>{from, to}, where);
}

}  // namespace fathom::exec::portable
