// Meshes and height fields of the bodies' shapes, in device memory. Each has buffers of its own, which live while some
// body uses it: surfaces are few and large.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <unordered_map>
#include <vector>

#include "exec/buffer.hpp"
#include "terrain/surface_view.hpp"

namespace fathom::device {

class SurfaceMemory {
 public:
  explicit SurfaceMemory(exec::Memory& memory) : memory_(memory), views_(memory), staged_views_(memory, 0) {}

  /// Another body uses the surface; `upload` copies it to the device if it is new there.
  void begin_use(const std::shared_ptr<const Surface>& surface);
  /// A body stops using it from step `step` on. Until `step_finished(step)` the surface stays in place.
  void end_use(const Surface* surface, std::uint64_t step);
  void step_finished(std::uint64_t step);
  /// Index of a surface in use.
  std::uint32_t index_of(const Surface* surface) const { return indices_.at(surface); }

  bool is_current() const { return new_.empty(); }
  /// Whether `upload` will replace the array of views.
  bool must_grow() const { return entries_.size() > views_.size(); }

  template <class D>
  void upload(D& device) {
    if (must_grow()) {
      views_.grow(2 * entries_.size());
      staged_views_ = exec::PinnedBuffer<SurfaceView>(memory_, views_.size());
      new_.clear();
      for (std::uint32_t index = 0; index < entries_.size(); ++index)
        if (entries_[index].surface) new_.push_back(index);
    }
    for (; !new_.empty(); new_.pop_back()) {
      Entry& entry = entries_[new_.back()];
      if (!entry.is_uploaded) put(device, entry);
      entry.is_uploaded = true;
      staged_views_[new_.back()] = entry.view;
      device.copy_to_device(views_.data() + new_.back(), staged_views_.data() + new_.back(), 1);
    }
  }
  const SurfaceView* views() const { return views_.data(); }

 private:
  struct Entry {
    explicit Entry(exec::Memory& memory)
        : points(memory),
          indices(memory),
          nodes(memory),
          heights(memory),
          holes(memory),
          materials(memory),
          material_numbers(memory) {}

    std::shared_ptr<const Surface> surface;  ///< none: the index is free
    std::uint32_t uses = 0;
    bool is_uploaded = false;
    SurfaceView view;
    exec::Buffer<Vec3> points;
    exec::Buffer<std::uint32_t> indices;
    exec::Buffer<BoxTreeNode> nodes;
    exec::Buffer<float> heights;
    exec::Buffer<std::uint64_t> holes;
    exec::Buffer<Material> materials;
    exec::Buffer<std::uint8_t> material_numbers;
  };
  struct EndedUse {
    std::uint64_t step;
    const Surface* surface;
  };

  /// Copies a list to the device, and waits: surfaces may be larger than memory should be pinned for long.
  template <class D, class T>
  const T* put(D& device, exec::Buffer<T>& buffer, std::span<const T> list) {
    exec::PinnedBuffer<T> staging(memory_, list.size());
    std::copy(list.begin(), list.end(), staging.begin());
    buffer.grow(list.size());
    device.copy_to_device(buffer.data(), staging.data(), list.size());
    device.wait();
    return buffer.data();
  }
  template <class D>
  void put(D& device, Entry& entry) {
    SurfaceView& view = entry.view;
    view = {};
    view.bounds = entry.surface->bounds();
    if (!entry.surface->materials().empty()) {
      view.materials = put(device, entry.materials, entry.surface->materials());
      view.material_count = static_cast<std::uint32_t>(entry.surface->materials().size());
      view.material_numbers = put(device, entry.material_numbers, entry.surface->material_numbers());
    }
    if (const auto* const mesh = dynamic_cast<const TriangleMesh*>(entry.surface.get())) {
      view.vertices = put(device, entry.points, mesh->vertices());
      view.indices = put(device, entry.indices, mesh->indices());
      view.nodes = put(device, entry.nodes, mesh->nodes());
    } else {
      const auto& field = dynamic_cast<const HeightField&>(*entry.surface);
      view.columns = field.columns(), view.rows = field.rows();
      view.cell_x = field.cell_x(), view.cell_y = field.cell_y();
      view.heights = put(device, entry.heights, field.heights());
      const std::vector<std::uint64_t> holes = holes_of(field);
      if (!holes.empty()) view.holes = put(device, entry.holes, std::span<const std::uint64_t>(holes));
    }
  }
  static std::vector<std::uint64_t> holes_of(const HeightField& field);

  exec::Memory& memory_;
  std::vector<Entry> entries_;  // by index
  std::unordered_map<const Surface*, std::uint32_t> indices_;
  std::vector<std::uint32_t> free_, new_;
  std::deque<EndedUse> ended_;
  exec::Buffer<SurfaceView> views_;
  exec::PinnedBuffer<SurfaceView> staged_views_;
};

}  // namespace fathom::device
