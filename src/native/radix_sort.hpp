// Least-significant-digit radix sort, and insertion sort for few items; stable.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "world/growth.hpp"

namespace fathom::native {

/// Sorts by key(item), which has no bits above the lowest `bits`. `scratch` is working memory only.
template <class Item, class Key>
void radix_sort(std::vector<Item>& items, std::vector<Item>& scratch, int bits, const Key& key) {
  constexpr int digit_bits = 11;
  constexpr std::size_t buckets = 1u << digit_bits;
  constexpr std::size_t few = 64;
  if (items.size() <= few) {
    for (std::size_t i = 1; i < items.size(); ++i) {
      const Item item = items[i];
      std::size_t index = i;
      for (; index > 0 && key(items[index - 1]) > key(item); --index) items[index] = items[index - 1];
      items[index] = item;
    }
    return;
  }
  grow_to(scratch, items.size());
  for (int shift = 0; shift < bits; shift += digit_bits) {
    const auto digit = [&](const Item& item) { return static_cast<std::size_t>(key(item) >> shift & (buckets - 1)); };
    std::array<std::uint32_t, buckets> start{};
    for (const Item& item : items) ++start[digit(item)];
    if (start[digit(items[0])] == items.size()) continue;
    std::uint32_t sum = 0;
    for (std::uint32_t& s : start) sum += std::exchange(s, sum);
    for (const Item& item : items) scratch[start[digit(item)]++] = item;
    items.swap(scratch);
  }
}

}  // namespace fathom::native
