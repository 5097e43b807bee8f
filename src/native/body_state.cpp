#include "native/body_state.hpp"

#include "native/contact.hpp"
#include "world/growth.hpp"

namespace fathom::native {

template <class Act>
void BodyState::for_each_array(const Act& act) {
  act(poses, 0), act(velocities, 0), act(bounds, 0), act(flight, 0), act(flags, 0), act(slow_time, 0);
  act(colour_mask, 0), act(overflow_count, 0);
  act(forces, 0);
  act(solver, 1), act(motion, 0), act(warm, 0), act(inertia, 0), act(swings, 0);
}

void BodyState::resize(std::size_t slots) {
  for_each_array([&](auto& array, std::size_t extra) { grow_to(array, slots + extra); });
  grow_to(to_solve, (slots + 63) / 64);
}

void BodyState::reserve(std::size_t slots) {
  for_each_array([&](auto& array, std::size_t extra) { array.reserve(slots + extra); });
}

void BodyState::clear(std::uint32_t slot) {
  for_each_array([&](auto& array, std::size_t extra) { array[slot + extra] = {}; });
  note_to_solve(slot);
}

std::size_t BodyState::memory_bytes() const {
  std::size_t sum = to_solve.capacity() * sizeof(to_solve[0]);
  const_cast<BodyState*>(this)->for_each_array(
      [&](const auto& array, std::size_t) { sum += array.capacity() * sizeof(array[0]); });
  return sum;
}

}  // namespace fathom::native
