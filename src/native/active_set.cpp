#include "native/active_set.hpp"

#include <algorithm>
#include <bit>
#include <span>

#include "native/flag_scan.hpp"

namespace fathom::native {

void ActiveSet::refresh(const BodyTable& bodies, const BodyState& state) {
  if (is_current_) return;
  const std::span<const std::uint8_t> flags = std::span(state.flags).first(bodies.slot_count());
  constexpr std::uint64_t all_awake = awake * 0x0101010101010101u;
  std::size_t count = 0;
  for_each_eight_with(
      awake, flags, [&](std::size_t, std::uint64_t eight) { count += static_cast<std::size_t>(std::popcount(eight)); });
  active_.resize(count);
  std::uint32_t* next = active_.data();
  for_each_eight_with(awake, flags, [&](std::size_t slot, std::uint64_t eight) {
    if (eight == all_awake) {
      for (std::uint32_t i = 0; i < 8; ++i) next[i] = static_cast<std::uint32_t>(slot) + i;
      next += 8;
      return;
    }
    for (; eight != 0; eight &= eight - 1)
      *next++ = static_cast<std::uint32_t>(slot + static_cast<std::size_t>(std::countr_zero(eight)) / 8);
  });
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

bool ActiveSet::agrees_with(const BodyTable& bodies, const BodyState& state) const {
  ActiveSet again;
  again.refresh_in_contact(bodies, state);
  if (is_current_ && active_ != again.active_) return false;
  return !is_current_ || !in_contact_is_current_ ||
         (in_contact_ == again.in_contact_ && kinematic_ == again.kinematic_);
}

void ActiveSet::drop_isolated(const BodyState& state) {
  std::erase_if(in_contact_, [&](std::uint32_t slot) { return state.flags[slot] & isolated; });
}

}  // namespace fathom::native
