#include "device/query_buffers.hpp"

#include <algorithm>
#include <numeric>

namespace fathom::device {

void OverlapBatch::pass_on(std::size_t first, std::size_t size, std::size_t found_count, const TakeTouched& take) {
  const std::span<const Overlap> all(found_read.data(), found_count);
  // Sorts by shape: counts, then fills each shape's part from its end.
  begins.assign(size + 1, 0);
  for (const Overlap& overlap : all) ++begins[overlap.shape];
  std::inclusive_scan(begins.begin(), begins.end(), begins.begin());
  slots.resize(found_count);
  for (const Overlap& overlap : all) slots[--begins[overlap.shape]] = overlap.slot;
  for (std::size_t i = 0; i < size; ++i) {
    const std::span<std::uint32_t> of_shape(slots.data() + begins[i], begins[i + 1] - begins[i]);
    std::ranges::sort(of_shape);  // the device finds them in any order
    take(first + i, of_shape);
  }
}

}  // namespace fathom::device
