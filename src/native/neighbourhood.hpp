// Which bodies lie together, so that a thread's share of bodies and its shares of the colours' contacts are about the
// same place, and stay in its cache from loop to loop. It orders work that may be done in any order: no result
// depends on it.
#pragma once

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
  /// Takes over the order of the broad phase, where it is a new one. `slot_count`: upper end of slots.
  void update(const BroadPhase& broad_phase, std::size_t slot_count) {
    if (order_ == broad_phase.order() && places_.size() >= slot_count) return;
    order_ = broad_phase.order();
    slots_.clear();
    broad_phase.list_neighbours(slots_);
    grow_to(places_, slot_count);
    for (std::size_t i = 0; i < slots_.size(); ++i)
      places_[slots_[i]] = static_cast<std::uint8_t>(i * place_count / slots_.size());
  }

  /// All bodies that can move, neighbours near each other.
  std::span<const std::uint32_t> slots() const { return slots_; }

  /// Writes `items` to `sorted`, by the place of slot_of(item).
  template <class SlotOf>
  void sort(std::span<const std::uint32_t> items, const SlotOf& slot_of, std::span<std::uint32_t> sorted) const {
    std::array<std::uint32_t, place_count> next{};
    for (const std::uint32_t item : items) ++next[places_[slot_of(item)]];
    std::uint32_t sum = 0;
    for (std::uint32_t& n : next) sum += std::exchange(n, sum);
    for (const std::uint32_t item : items) sorted[next[places_[slot_of(item)]]++] = item;
  }

  std::size_t memory_bytes() const { return slots_.capacity() * sizeof(std::uint32_t) + places_.capacity(); }

 private:
  static constexpr std::size_t place_count = 256;

  std::uint64_t order_ = 0;
  std::vector<std::uint32_t> slots_;
  std::vector<std::uint8_t> places_;  // by slot
};

}  // namespace fathom::native
