// Hulls of the bodies' shapes, in device memory.
//
// A hull keeps its index while some body uses it. Its vertices, edges and faces are appended to the arrays; if these
// are full, the hulls still in use are compacted. A stream of bodies, each with its own hull, thus takes only as much
// memory as the bodies that live at one time, and uploads each hull once.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <memory>
#include <unordered_map>
#include <vector>

#include "device/body_arrays.hpp"
#include "exec/buffer.hpp"

namespace fathom::device {

class HullMemory {
 public:
  explicit HullMemory(exec::Memory& memory);

  /// Another body uses the hull; `upload` copies it to the device if it is new there.
  void begin_use(const std::shared_ptr<const Hull>& hull);
  /// A body stops using it from step `step` on. Until `step_finished(step)` the hull stays in place.
  void end_use(const Hull* hull, std::uint64_t step);
  void step_finished(std::uint64_t step);
  /// Index of a hull in use.
  std::uint32_t index_of(const Hull* hull) const { return indices_.at(hull); }

  bool is_current() const { return new_.empty() && !must_pack_; }
  /// Whether `upload` will allocate new memory.
  bool must_grow() const;
  /// Number of hulls in use, or in use until a step finishes.
  std::size_t count() const { return indices_.size(); }

  template <class D>
  void upload(D& device) {
    if (must_pack_ || !fits(total(new_))) {
      device.wait();  // for pending copies from the host's side
      must_pack_ = true;
      grow(device);
      pack();
      must_pack_ = false;
    } else {
      for (const std::uint32_t index : new_) write(index);
    }
    new_.clear();
    copy(device, records_), copy(device, vertices_), copy(device, edges_), copy(device, planes_);
    copy(device, face_edges_), copy(device, vertex_edges_);
  }
  HullArrays arrays() const;

 private:
  /// An array on the device and its image on the host, the source of uploads.
  template <class T>
  struct Column {
    explicit Column(exec::Memory& memory) : device(memory), host(memory, 0) {}

    exec::Buffer<T> device;
    exec::PinnedBuffer<T> host;
    std::size_t size = 0;
    std::size_t changed_begin = 0, changed_end = 0;  ///< not uploaded yet

    std::size_t room() const { return std::min(device.size(), host.size()); }
    void note(std::size_t begin, std::size_t end) {
      changed_begin = changed_begin == changed_end ? begin : std::min(changed_begin, begin);
      changed_end = std::max(changed_end, end);
    }
    template <class List>
    std::uint32_t append(const List& list) {
      const std::size_t begin = size;
      std::copy(list.begin(), list.end(), host.begin() + begin);
      size += list.size();
      note(begin, size);
      return static_cast<std::uint32_t>(begin);
    }
  };
  struct Extent {
    std::size_t records = 0, vertices = 0, edges = 0, planes = 0, face_edges = 0;
  };
  struct Entry {
    std::shared_ptr<const Hull> hull;  ///< none: the index is free
    std::uint32_t uses = 0;
  };
  struct EndedUse {
    std::uint64_t step;
    const Hull* hull;
  };

  template <class D, class T>
  static void copy(D& device, Column<T>& column) {
    if (column.changed_begin < column.changed_end)
      device.copy_to_device(column.device.data() + column.changed_begin, column.host.data() + column.changed_begin,
                            column.changed_end - column.changed_begin);
    column.changed_begin = column.changed_end = 0;
  }
  Extent total(const std::vector<std::uint32_t>& indices) const;
  Extent total_in_use() const;
  /// Whether that much can be appended.
  bool fits(const Extent& more) const;
  void grow(exec::Memory& memory);
  void pack();
  void write(std::uint32_t index);

  std::vector<Entry> entries_;  // by index
  std::unordered_map<const Hull*, std::uint32_t> indices_;
  std::vector<std::uint32_t> free_, new_;
  std::deque<EndedUse> ended_;
  bool must_pack_ = false;  // growing has begun but not ended
  Column<HullRecord> records_;
  Column<Vec3> vertices_;
  Column<Hull::HalfEdge> edges_;
  Column<Hull::Plane> planes_;
  Column<std::uint16_t> face_edges_;
  Column<std::uint16_t> vertex_edges_;  // same length as vertices_
};

}  // namespace fathom::device
