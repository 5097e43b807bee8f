// Ascending lists of distinct slots.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace fathom::native {

inline bool has_slot(const std::vector<std::uint32_t>& slots, std::uint32_t slot) {
  return std::ranges::binary_search(slots, slot);
}

/// Returns whether the slot is new.
inline bool insert_slot(std::vector<std::uint32_t>& slots, std::uint32_t slot) {
  const auto at = std::ranges::lower_bound(slots, slot);
  if (at != slots.end() && *at == slot) return false;
  slots.insert(at, slot);
  return true;
}

/// Returns whether the slot was in the list.
inline bool erase_slot(std::vector<std::uint32_t>& slots, std::uint32_t slot) {
  const auto at = std::ranges::lower_bound(slots, slot);
  if (at == slots.end() || *at != slot) return false;
  slots.erase(at);
  return true;
}

}  // namespace fathom::native
