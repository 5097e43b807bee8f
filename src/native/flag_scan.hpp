// Finds the bodies with a flag, in worlds where usually none of a million bodies has it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace fathom::native {

/// For each group of eight bodies, from `slot` on, of which any has a flag of `mask`, calls act(slot, eight). `eight`
/// contains only these flags, one byte per body, the first lowest. The last group may be smaller. A cache line of flags
/// takes one branch.
template <class Act>
void for_each_eight_with(std::uint8_t mask, std::span<const std::uint8_t> flags, const Act& act) {
  const std::uint64_t wanted = mask * std::uint64_t{0x0101010101010101};
  const auto eight_from = [&](std::size_t slot) {
    std::uint64_t eight;
    std::memcpy(&eight, &flags[slot], 8);
    return eight & wanted;
  };
  const auto look_at = [&](std::size_t slot, std::size_t end) {
    for (; slot + 8 <= end; slot += 8)
      if (const std::uint64_t eight = eight_from(slot); eight != 0) act(slot, eight);
  };
  constexpr std::size_t line = 64;
  std::size_t slot = 0;
  for (; slot + line <= flags.size(); slot += line) {
    std::uint64_t any = 0;
    for (std::size_t k = 0; k < line; k += 8) any |= eight_from(slot + k);
    if (any != 0) look_at(slot, slot + line);
  }
  look_at(slot, flags.size());
  slot += (flags.size() - slot) / 8 * 8;
  std::uint64_t rest = 0;
  for (std::size_t i = slot; i < flags.size(); ++i) rest |= std::uint64_t{flags[i]} << 8 * (i - slot);
  if ((rest &= wanted) != 0) act(slot, rest);
}

}  // namespace fathom::native
