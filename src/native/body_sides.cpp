#include "native/body_sides.hpp"

#include <algorithm>
#include <utility>

#include "native/sorted_slots.hpp"

namespace fathom::native {

namespace {

void list_all(const BodyTable& bodies, BodySides& sides) {
  sides.moving.clear();
  std::vector<std::uint32_t> fixed;
  for (const BodyId id : bodies.living())
    (bodies[id.index].motion == MotionType::fixed ? fixed : sides.moving).push_back(id.index);
  sides.fixed.set_all(std::move(fixed));
}

}  // namespace

bool BodySides::take(const BodyTable& bodies, std::span<const std::uint32_t> set_changes) {
  constexpr std::size_t few = 64;  // lists all if more than one body in this many changed
  if (lists_all || few * set_changes.size() > bodies.count()) {
    list_all(bodies, *this);
    lists_all = false;
    return true;
  }
  bool any_moves = false;
  for (const std::uint32_t slot : set_changes) {
    const bool is_there = bodies.alive(slot);
    const bool is_fixed = is_there && bodies[slot].motion == MotionType::fixed;
    any_moves |= erase_slot(moving, slot);
    if (is_there && !is_fixed) any_moves |= insert_slot(moving, slot);
    if (fixed.contains(slot)) fixed.remove(slot);
    if (is_fixed) fixed.add(slot);
  }
  return any_moves;
}

void BodySides::save(ByteWriter& write) const {
  write(moving, lists_all);
  fixed.save(write);
}

void BodySides::restore(ByteReader& in, std::span<const BodyBounds> bounds, ThreadPool& pool) {
  in(moving, lists_all);
  in.require(std::ranges::is_sorted(moving));
  in.require(moving.empty() || moving.back() < bounds.size());
  fixed.restore(in, bounds, pool);
}

}  // namespace fathom::native
