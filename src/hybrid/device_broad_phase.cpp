#include "hybrid/device_broad_phase.hpp"

#include <algorithm>

namespace fathom::hybrid {

void DeviceBroadPhase::collect_updates(const native::BroadPhaseInput& input) {
  updates_.clear();
  std::sort(emptied_.begin(), emptied_.end());
  emptied_.erase(std::unique(emptied_.begin(), emptied_.end()), emptied_.end());
  for (const std::uint32_t slot : emptied_)
    if (!input.bodies.alive(slot)) {
      device::BoxUpdate update;
      update.slot = slot;
      updates_.push_back(update);
    }
  emptied_.clear();
  const auto update = [&](std::uint32_t slot) {
    const Aabb& box = input.state.bounds[slot].fat_box;
    updates_.push_back({box.lower, slot, box.upper, input.is_changed(slot) ? 1u : 0u});
  };
  if (all_boxes_)
    for (const BodyId id : input.bodies.living()) update(id.index);
  else
    for (const std::uint32_t slot : input.changed) update(slot);
  all_boxes_ = false;
}

std::size_t DeviceBroadPhase::find(const native::BroadPhaseInput& input, ThreadPool&,
                                   std::vector<std::vector<native::Pair>>& found) {
  bodies_ = &input.bodies;
  sets_ += input.set_changed() || sets_ == 0;
  collect_updates(input);
  detection_.begin_search(updates_, input.bodies.slot_count(), input.set_changed());
  meanwhile_();
  found.resize(std::max<std::size_t>(found.size(), 1));
  std::vector<native::Pair>& list = found.front();
  list.clear();
  for (const device::PairRecord pair : detection_.found_pairs())
    if (input.is_wanted(pair.a, pair.b)) list.push_back({std::min(pair.a, pair.b), std::max(pair.a, pair.b)});
  // The device finds pairs in any order.
  std::sort(list.begin(), list.end(),
            [](const native::Pair& x, const native::Pair& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; });
  return 1;
}

void DeviceBroadPhase::list_neighbours(std::vector<std::uint32_t>& slots) const {
  for (const BodyId id : bodies_->living())
    if ((*bodies_)[id.index].motion != MotionType::fixed) slots.push_back(id.index);
}

std::size_t DeviceBroadPhase::memory_bytes() const {
  return detection_.memory_bytes() + updates_.capacity() * sizeof(device::BoxUpdate);
}

void DeviceBroadPhase::restore(ByteReader&, std::span<const native::BodyBounds>, ThreadPool&) { all_boxes_ = true; }

}  // namespace fathom::hybrid
