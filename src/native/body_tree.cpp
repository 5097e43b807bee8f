#include "native/body_tree.hpp"

namespace fathom::native {

void BodyTree::note(std::vector<std::uint32_t>& list, std::uint32_t slot) {
  constexpr std::size_t most = 1024;  // bounds memory: there may never be a query
  if (sides_.lists_all) return;
  list.push_back(slot);
  if (list.size() < most) return;
  sides_.lists_all = true;
  set_changes_.clear();
  moved_fixed_.clear();
}

void BodyTree::refresh(const BodyTable& bodies, const BodyBounds* bounds, ThreadPool& pool) {
  refresh_fixed(bodies, bounds, pool);
  if (!set_changed_ && others_moved_) moving_.refit(bounds, pool);
  if (set_changed_ || moving_.is_loose()) moving_.build(sides_.moving, bounds, pool);
  set_changed_ = others_moved_ = false;  // last: memory may run out before
}

void BodyTree::refresh_fixed(const BodyTable& bodies, const BodyBounds* bounds, ThreadPool& pool) {
  set_changed_ |= sides_.take(bodies, set_changes_);
  for (const std::uint32_t slot : moved_fixed_)
    if (sides_.fixed.contains(slot)) sides_.fixed.note_moved(slot);  // may have been removed since
  sides_.fixed.refresh(bounds, pool);
  set_changes_.clear();
  moved_fixed_.clear();
}

void BodyTree::visit(const MovingBox& box, BodyVisitor& visitor) const {
  sides_.fixed.visit(box, moving_.visit(box, 1.0f, visitor), visitor);
}

std::size_t BodyTree::memory_bytes() const {
  return moving_.memory_bytes() + sides_.fixed.memory_bytes() +
         (sides_.moving.capacity() + set_changes_.capacity() + moved_fixed_.capacity()) * sizeof(std::uint32_t);
}

}  // namespace fathom::native
