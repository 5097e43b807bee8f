#include "native/active_set.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <span>

namespace fathom::native {

void ActiveSet::refresh(const BodyTable& bodies, const BodyState& state) {
  if (is_current_) return;
  active_.clear();
  const std::span<const std::uint8_t> flags = std::span(state.flags).first(bodies.slot_count());
  const auto list = [&](std::size_t begin, std::size_t end) {
    for (std::size_t slot = begin; slot < end; ++slot)
      if (flags[slot] & awake) active_.push_back(static_cast<std::uint32_t>(slot));
  };
  // Eight at a time: in a large world mostly none of them is awake.
  constexpr std::uint64_t any_awake = awake * 0x0101010101010101u;
  std::size_t slot = 0;
  for (; slot + 8 <= flags.size(); slot += 8) {
    std::uint64_t eight;
    std::memcpy(&eight, &flags[slot], 8);
    if (eight & any_awake) list(slot, slot + 8);
  }
  list(slot, flags.size());
  is_current_ = true;
  in_contact_is_current_ = false;
}

void ActiveSet::refresh_in_contact(const BodyTable& bodies, const BodyState& state) {
  refresh(bodies, state);
  if (in_contact_is_current_) return;
  ++sorting_;
  in_contact_is_current_ = true;
  in_contact_.clear();
  kinematic_.clear();
  for (std::size_t i = 0; i < state.to_solve.size(); ++i)
    for (std::uint64_t bits = state.to_solve[i]; bits != 0; bits &= bits - 1) {
      const auto slot = static_cast<std::uint32_t>(64 * i) + static_cast<std::uint32_t>(std::countr_zero(bits));
      if (!(state.flags[slot] & awake)) continue;
      in_contact_.push_back(slot);
      if (state.flags[slot] & native::kinematic) kinematic_.push_back(slot);
    }
}

void ActiveSet::drop_isolated(const BodyState& state) {
  std::erase_if(in_contact_, [&](std::uint32_t slot) { return state.flags[slot] & isolated; });
}

}  // namespace fathom::native
