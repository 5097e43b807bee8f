#include "native/changed_bodies.hpp"

#include <algorithm>

#include "native/flag_scan.hpp"
#include "native/tuning.hpp"
#include "world/growth.hpp"

namespace fathom::native {

void ChangedBodies::collect(std::span<const std::uint8_t> flags, ThreadPool& pool) {
  const std::size_t chunks = (flags.size() + flags_grain - 1) / flags_grain;
  if (slots_.size() < flags.size()) {
    grow_to(slots_, flags.size());
    grow_to(found_, chunks);
  }
  pool.for_each_chunk(flags.size(), flags_grain, [&](std::size_t begin, std::size_t end) {
    Found found;
    std::uint32_t* const slots = &slots_[begin];
    // Branch-free: the flags are unpredictable.
    const auto look_at = [&](std::size_t first, std::size_t last) {
      for (std::size_t slot = first; slot < last; ++slot) {
        const std::uint8_t f = flags[slot];
        slots[found.count] = static_cast<std::uint32_t>(slot);
        found.count += (f & box_changed) != 0;
        found.at_rest |= (f & (box_changed | awake)) == box_changed;
      }
    };
    for_each_eight_with(box_changed, flags.subspan(begin, end - begin), [&](std::size_t first, std::uint64_t) {
      look_at(begin + first, std::min(begin + first + 8, end));
    });
    found_[begin / flags_grain] = found;
  });
  count_ = 0;
  any_at_rest_ = false;
  for (std::size_t i = 0; i < chunks; ++i) {
    const auto first = slots_.begin() + static_cast<std::ptrdiff_t>(i * flags_grain);
    std::copy_n(first, found_[i].count, slots_.begin() + static_cast<std::ptrdiff_t>(count_));
    count_ += found_[i].count;
    any_at_rest_ |= found_[i].at_rest;
  }
}

}  // namespace fathom::native
