#include "device/hull_memory.hpp"

#include "check/check.hpp"

namespace fathom::device {

namespace {

/// Allocated memory as a multiple of that in use, so hulls are rarely compacted.
constexpr std::size_t spare_room = 4;
constexpr std::size_t min_records = 64;

}  // namespace

HullMemory::HullMemory(exec::Memory& m)
    : records_(m), vertices_(m), edges_(m), planes_(m), face_edges_(m), vertex_edges_(m) {}

void HullMemory::begin_use(const std::shared_ptr<const Hull>& hull) {
  const auto [found, is_new] = indices_.emplace(hull.get(), static_cast<std::uint32_t>(entries_.size()));
  if (!is_new) {
    ++entries_[found->second].uses;
    return;
  }
  if (free_.empty()) {
    entries_.emplace_back();
  } else {
    found->second = free_.back();
    free_.pop_back();
  }
  entries_[found->second] = {hull, 1};
  new_.push_back(found->second);
}

void HullMemory::end_use(const Hull* hull, std::uint64_t step) { ended_.push_back({step, hull}); }

void HullMemory::step_finished(std::uint64_t step) {
  for (; !ended_.empty() && ended_.front().step <= step; ended_.pop_front()) {
    const auto found = indices_.find(ended_.front().hull);
    FATHOM_ASSERT(found != indices_.end());
    const std::uint32_t index = found->second;
    if (--entries_[index].uses > 0) continue;
    entries_[index].hull.reset();
    indices_.erase(found);
    std::erase(new_, index);
    free_.push_back(index);
  }
}

HullMemory::Extent HullMemory::total(const std::vector<std::uint32_t>& indices) const {
  Extent sum{entries_.size(), 0, 0, 0, 0};
  for (const std::uint32_t index : indices) {
    const Hull& hull = *entries_[index].hull;
    sum.vertices += hull.vertices().size(), sum.edges += hull.edges().size();
    sum.planes += hull.planes().size(), sum.face_edges += hull.face_edges().size();
  }
  return sum;
}

HullMemory::Extent HullMemory::total_in_use() const {
  std::vector<std::uint32_t> indices;
  for (const auto& [hull, index] : indices_) indices.push_back(index);
  return total(indices);
}

bool HullMemory::fits(const Extent& more) const {
  return more.records <= records_.room() && vertices_.size + more.vertices <= vertices_.room() &&
         edges_.size + more.edges <= edges_.room() && planes_.size + more.planes <= planes_.room() &&
         face_edges_.size + more.face_edges <= face_edges_.room();
}

// If half of the memory is in use, it would soon need compaction again.
bool HullMemory::must_grow() const {
  if (must_pack_) return true;
  if (fits(total(new_))) return false;
  const Extent all = total_in_use();
  return all.records > records_.room() || 2 * all.vertices > vertices_.room() || 2 * all.edges > edges_.room() ||
         2 * all.planes > planes_.room() || 2 * all.face_edges > face_edges_.room();
}

void HullMemory::grow(exec::Memory& memory) {
  const Extent all = total_in_use();
  const auto reserve = [&](auto& column, std::size_t in_use) {
    if (2 * in_use <= column.room()) return;
    column.device.grow(spare_room * in_use);
    column.host = std::decay_t<decltype(column.host)>(memory, spare_room * in_use);
  };
  // Records are not moved: indices without a hull are reused.
  if (all.records > records_.room()) reserve(records_, std::max(all.records, min_records));
  reserve(vertices_, all.vertices), reserve(vertex_edges_, all.vertices), reserve(edges_, all.edges),
      reserve(planes_, all.planes);
  reserve(face_edges_, all.face_edges);
}

void HullMemory::pack() {
  vertices_.size = vertex_edges_.size = edges_.size = planes_.size = face_edges_.size = 0;
  for (std::uint32_t index = 0; index < entries_.size(); ++index)
    if (entries_[index].hull) write(index);
}

void HullMemory::write(std::uint32_t index) {
  const Hull& hull = *entries_[index].hull;
  records_.host[index] = {vertices_.append(hull.vertices()),
                          edges_.append(hull.edges()),
                          planes_.append(hull.planes()),
                          face_edges_.append(hull.face_edges()),
                          static_cast<int>(hull.vertices().size()),
                          static_cast<int>(hull.edges().size()),
                          static_cast<int>(hull.planes().size()),
                          hull.inner_radius(),
                          hull.largest_coordinate(),
                          hull.radius()};
  vertex_edges_.append(hull.vertex_edges());
  records_.note(index, index + 1);
}

HullArrays HullMemory::arrays() const {
  return {records_.device.data(), vertices_.device.data(),   edges_.device.data(),
          planes_.device.data(),  face_edges_.device.data(), vertex_edges_.device.data()};
}

}  // namespace fathom::device
