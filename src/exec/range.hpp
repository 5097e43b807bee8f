// Number of items of a submission.
#pragma once

#include <cstdint>

#include "exec/error.hpp"
#include "fathom/math.hpp"

namespace fathom::exec {

/// Maximum items of one submission: a work-item's index plus the launch's width still fits 32 bits.
inline constexpr std::uint32_t max_items = 1u << 31;

inline void check_items(std::size_t items, const Where& where) {
  if (items > max_items) {
    throw DeviceError(ErrorCode::invalid_argument, std::to_string(items) + " items are more than a kernel can number",
                      0, where);
  }
}

/// Items 0 … size()−1, where the size is known at submission, or is read on the device when it runs.
///
/// With counts in device memory a whole step can be recorded once and replayed while counts change: `capacity` sizes
/// the launch, and work-items beyond the count return early. A count above the capacity (an overflowed counter) is
/// clamped to it, so no kernel writes past its buffers.
struct Range {
  const std::uint32_t* count = nullptr;  ///< in device memory, or null: exactly `capacity` items
  std::uint32_t capacity = 0;

  Range(std::uint32_t n) : capacity(n) {}  // implicit: a number is a range
  Range(const std::uint32_t* count_on_device, std::uint32_t largest) : count(count_on_device), capacity(largest) {}

  static Range of(std::size_t n, const Where& where) {
    check_items(n, where);
    return {static_cast<std::uint32_t>(n)};
  }

  FATHOM_HD std::uint32_t size() const { return count && *count < capacity ? *count : capacity; }
};
}  // namespace fathom::exec
