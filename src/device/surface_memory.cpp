#include "device/surface_memory.hpp"

#include "check/check.hpp"

namespace fathom::device {

void SurfaceMemory::begin_use(const std::shared_ptr<const Surface>& surface) {
  const auto [found, is_new] = indices_.emplace(surface.get(), static_cast<std::uint32_t>(entries_.size()));
  if (!is_new) {
    ++entries_[found->second].uses;
    return;
  }
  if (free_.empty()) {
    entries_.emplace_back(memory_);
  } else {
    found->second = free_.back();
    free_.pop_back();
  }
  entries_[found->second].surface = surface;
  entries_[found->second].uses = 1;
  new_.push_back(found->second);
}

void SurfaceMemory::end_use(const Surface* surface, std::uint64_t step) { ended_.push_back({step, surface}); }

void SurfaceMemory::step_finished(std::uint64_t step) {
  for (; !ended_.empty() && ended_.front().step <= step; ended_.pop_front()) {
    const auto found = indices_.find(ended_.front().surface);
    FATHOM_ASSERT(found != indices_.end());
    const std::uint32_t index = found->second;
    if (--entries_[index].uses > 0) continue;
    entries_[index] = Entry(memory_);
    indices_.erase(found);
    std::erase(new_, index);
    free_.push_back(index);
  }
}

std::vector<std::uint64_t> SurfaceMemory::holes_of(const HeightField& field) {
  const std::uint32_t cells = (field.columns() - 1) * (field.rows() - 1);
  std::vector<std::uint64_t> holes((cells + 63) / 64);
  bool any = false;
  for (std::uint32_t cell = 0; cell < cells; ++cell) {
    holes[cell / 64] |= std::uint64_t{field.is_hole(cell)} << cell % 64;
    any = any || field.is_hole(cell);
  }
  return any ? holes : std::vector<std::uint64_t>{};
}

}  // namespace fathom::device
