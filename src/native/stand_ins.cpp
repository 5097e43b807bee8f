#include "native/stand_ins.hpp"

#include <algorithm>

#include "native/constraint_fields.hpp"
#include "world/growth.hpp"

namespace fathom::native {

void StandIns::lay_out(const ConstraintLayout& layout) {
  parts_.clear();
  width_ = layout.width();
  const std::size_t bodies = layout.kinematic().size();
  if (bodies == 0) return;
  std::size_t next = 0;
  const auto add = [&](ConstraintLayout::Range blocks) {
    parts_.push_back({blocks, next, next});
    next += std::min(bodies, (blocks.end - blocks.begin) * width_);
  };
  for (const ConstraintLayout::Group& group : layout.groups()) add(group.blocks);
  for (const ConstraintLayout::Unit& unit : layout.first_units()) add(unit.blocks);
  if (slots_.size() < next) grow_to(slots_, next);
  const std::size_t entries = 1 + state_.size() + next;
  if (state_.solver.size() < entries) grow_to(state_.solver, entries);
}

/// Calls act(a) for lanes' indices of A in blocks with a moving non-dynamic body. Those blocks come last.
template <class Act>
void StandIns::for_each_moving(const Part& part, BlockArray blocks, const Act& act) const {
  for (std::size_t i = part.blocks.end; i-- > part.blocks.begin;) {
    std::byte* const block = blocks.blocks + i * blocks.stride;
    const BlockHeader& header = *reinterpret_cast<const BlockHeader*>(block);
    if (!header.fixed_a) return;
    if (header.still_a) continue;
    auto* const a = reinterpret_cast<std::uint32_t*>(block + block_header_bytes);
    for (std::size_t lane = 0; lane < header.lanes; ++lane)
      if (a[lane] != none) act(a[lane]);
  }
}

void StandIns::make(std::size_t part, BlockArray blocks) {
  if (!any()) return;
  Part& p = parts_[part];
  p.end = p.first;
  std::uint32_t last = none, of_last = none;
  for_each_moving(p, blocks, [&](std::uint32_t& a) {
    const SolverBody& body = state_.solver_bodies()[a];
    if (length_squared(body.linear) + length_squared(body.angular) == 0) return;  // it does not move
    if (a != last) last = a, of_last = stand_in_for(p, a);
    a = of_last;
  });
}

std::uint32_t StandIns::stand_in_for(Part& part, std::uint32_t slot) {
  const std::uint32_t* const first = slots_.data() + part.first;
  const std::uint32_t* const end = slots_.data() + part.end;
  const std::uint32_t* const known = std::find(first, end, slot);
  const auto stand_in = static_cast<std::size_t>(known - slots_.data());
  if (known == end) {
    slots_[part.end++] = slot;
    SolverBody& body = state_.solver_bodies()[entry(stand_in)];
    body = state_.solver_bodies()[slot];
    body.moved = body.turned = {};
  }
  return entry(stand_in);
}

void StandIns::move(std::size_t part, float h) {
  if (!any()) return;
  for (std::size_t i = parts_[part].first; i < parts_[part].end; ++i) {
    SolverBody& body = state_.solver_bodies()[entry(i)];
    body.moved = mul_add(body.moved, h, body.linear);
    body.turned = mul_add(body.turned, h, body.angular);
  }
}

void StandIns::remove(std::size_t part, BlockArray blocks) {
  if (!any()) return;
  for_each_moving(parts_[part], blocks, [&](std::uint32_t& a) {
    if (a >= state_.size()) a = slots_[a - state_.size()];
  });
}

}  // namespace fathom::native
