#include "native/fixed_tree.hpp"

#include <algorithm>
#include <utility>

#include "native/sorted_slots.hpp"

namespace fathom::native {

void FixedTree::set_all(std::vector<std::uint32_t> slots) {
  slots_ = std::move(slots);
  sorts_all_ = true;
}

bool FixedTree::contains(std::uint32_t slot) const { return has_slot(slots_, slot); }

void FixedTree::add(std::uint32_t slot) {
  insert_slot(slots_, slot);
  note_late(slot);
}

void FixedTree::remove(std::uint32_t slot) {
  erase_slot(slots_, slot);
  if (sorts_all_) return;
  if (erase_slot(late_slots_, slot))
    sorts_late_ = true;
  else
    insert_slot(stale_, slot);
}

void FixedTree::note_moved(std::uint32_t slot) {
  if (sorts_all_) return;
  if (!has_slot(late_slots_, slot)) insert_slot(stale_, slot);
  note_late(slot);
}

void FixedTree::note_late(std::uint32_t slot) {
  if (sorts_all_) return;
  insert_slot(late_slots_, slot);
  sorts_late_ = true;
  sorts_all_ = late_slots_.size() > max_late();
}

std::size_t FixedTree::max_late() const { return std::min<std::size_t>(4096, 32 + slots_.size() / 8); }

void FixedTree::refresh(const BodyBounds* bounds, ThreadPool& pool) {
  if (sorts_all_ || stale_.size() > max_late()) {
    late_slots_.clear();
    stale_.clear();
    tree_.build(slots_, bounds, pool);
    sorts_late_ = true;
  }
  if (sorts_late_) late_.build(late_slots_, bounds, pool);
  sorts_all_ = sorts_late_ = false;  // last: an allocation above may fail
}

void FixedTree::overlap(const Aabb& box, std::vector<std::uint32_t>& found) const {
  const auto first = static_cast<std::ptrdiff_t>(found.size());
  tree_.overlap(box, found);
  if (!stale_.empty())
    found.erase(
        std::remove_if(found.begin() + first, found.end(), [&](std::uint32_t slot) { return has_slot(stale_, slot); }),
        found.end());
  if (!late_slots_.empty()) late_.overlap(box, found);
}

float FixedTree::visit(const MovingBox& box, float limit, BodyVisitor& visitor) const {
  struct Fresh final : BodyVisitor {
    Fresh(const std::vector<std::uint32_t>& stale, float limit, BodyVisitor& visitor)
        : stale_(stale), limit_(limit), visitor_(visitor) {}
    float visit(std::uint32_t slot) override {
      if (!has_slot(stale_, slot)) limit_ = visitor_.visit(slot);
      return limit_;
    }

   private:
    const std::vector<std::uint32_t>& stale_;
    float limit_;
    BodyVisitor& visitor_;
  };
  Fresh fresh(stale_, limit, visitor);
  limit = tree_.visit(box, limit, stale_.empty() ? visitor : fresh);
  return late_slots_.empty() ? limit : late_.visit(box, limit, visitor);
}

void FixedTree::save(ByteWriter& write) const {
  write(slots_, late_slots_, stale_, sorts_all_, sorts_late_);
  tree_.save(write);
  late_.save(write);
}

void FixedTree::restore(ByteReader& in, std::span<const BodyBounds> bounds, ThreadPool& pool) {
  in(slots_, late_slots_, stale_, sorts_all_, sorts_late_);
  for (const auto* slots : {&slots_, &late_slots_, &stale_}) {
    in.require(std::ranges::is_sorted(*slots));
    in.require(slots->empty() || slots->back() < bounds.size());
  }
  tree_.restore(in, bounds, pool);
  late_.restore(in, bounds, pool);
}

std::size_t FixedTree::memory_bytes() const {
  return tree_.memory_bytes() + late_.memory_bytes() +
         (slots_.capacity() + late_slots_.capacity() + stale_.capacity()) * sizeof(std::uint32_t);
}

}  // namespace fathom::native
