// Which bodies are close together, so that a thread's share of bodies and its shares of the colours' contacts cover
// about the same region and stay in its cache from loop to loop. It orders only work whose order does not matter: no
// result depends on it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "native/broad_phase.hpp"
#include "world/growth.hpp"

namespace fathom::native {

class Neighbourhood {
 public:
  /// Adopts the broad phase's order if that has changed. `slot_count`: upper bound of slots.
  void update(const BroadPhase& broad_phase, std::size_t slot_count) {
    if (order_ == broad_phase.order() && regions_.size() >= slot_count) return;
    order_ = broad_phase.order();
    slots_.clear();
    broad_phase.list_neighbours(slots_);
    grow_to(regions_, slot_count);
    for (std::size_t i = 0; i < slots_.size(); ++i)
      regions_[slots_[i]] = static_cast<std::uint8_t>(i * region_count / slots_.size());
  }

  /// Bodies are in regions 0 … region_count − 1, equally many in each.
  static constexpr std::size_t region_count = 256;
  std::size_t region(std::uint32_t slot) const { return regions_[slot]; }

  /// Where the items of each region begin in a sorted list; the last entry is the list's size.
  using Offsets = std::array<std::uint32_t, region_count + 1>;

  /// Writes `items` to `sorted`, by the region of slot_of(item).
  template <class SlotOf>
  Offsets sort(std::span<const std::uint32_t> items, const SlotOf& slot_of, std::span<std::uint32_t> sorted) const {
    Offsets ends{};
    for (const std::uint32_t item : items) ++ends[region(slot_of(item))];
    std::uint32_t sum = 0;
    for (std::uint32_t& n : ends) sum += std::exchange(n, sum);
    // Each beginning advances to the region's end, which is the next one's beginning.
    for (const std::uint32_t item : items) sorted[ends[region(slot_of(item))]++] = item;
    Offsets offsets{};
    std::copy(ends.begin(), ends.end() - 1, offsets.begin() + 1);
    return offsets;
  }

  std::size_t memory_bytes() const { return slots_.capacity() * sizeof(std::uint32_t) + regions_.capacity(); }

 private:
  std::uint64_t order_ = 0;
  std::vector<std::uint32_t> slots_;   // in the order of neighbours
  std::vector<std::uint8_t> regions_;  // by slot
};

}  // namespace fathom::native
