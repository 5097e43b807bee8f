#include "native/body_tree.hpp"

#include <algorithm>

namespace fathom::native {

void BodyTree::refresh(const BodyTable& bodies, const BodyBounds* bounds, ThreadPool& pool) {
  list(bodies, {&moving_, &fixed_});
  for (Side* side : {&moving_, &fixed_}) refresh(*side, bounds, pool);
}

void BodyTree::refresh_fixed(const BodyTable& bodies, const BodyBounds* bounds, ThreadPool& pool) {
  list(bodies, {&fixed_});
  refresh(fixed_, bounds, pool);
}

void BodyTree::list(const BodyTable& bodies, std::initializer_list<Side*> sides) {
  bool any = false;
  for (Side* its : sides) {
    if (!its->set_changed) continue;
    its->slots.clear();
    any = true;
  }
  if (!any) return;
  for (const BodyId id : bodies.living()) {
    Side* const its = &side(bodies[id.index].motion);
    if (its->set_changed && std::ranges::find(sides, its) != sides.end()) its->slots.push_back(id.index);
  }
}

void BodyTree::refresh(Side& side, const BodyBounds* bounds, ThreadPool& pool) {
  if (!side.set_changed && side.moved) side.tree.refit(bounds, pool);
  if (side.set_changed || side.tree.is_loose()) side.tree.build(side.slots, bounds, pool);
  side.set_changed = side.moved = false;  // last: memory may run out before
}

void BodyTree::visit(const MovingBox& box, BodyVisitor& visitor) const {
  fixed_.tree.visit(box, moving_.tree.visit(box, 1.0f, visitor), visitor);
}

std::size_t BodyTree::memory_bytes() const {
  return moving_.tree.memory_bytes() + fixed_.tree.memory_bytes() +
         (moving_.slots.capacity() + fixed_.slots.capacity()) * sizeof(std::uint32_t);
}

}  // namespace fathom::native
