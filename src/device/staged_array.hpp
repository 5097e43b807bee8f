// An array on the device that is filled on the host.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "exec/buffer.hpp"

namespace fathom::device {

/// An array on the device and its image on the host, the source of uploads.
template <class T>
class StagedArray {
 public:
  explicit StagedArray(exec::Memory& memory) : memory_(memory), device_(memory), host_(memory, 0) {}

  /// The image, with at least `size` items. A larger one does not keep them. No copy may be under way.
  T* image(std::size_t size) {
    if (size > host_.size()) host_ = exec::PinnedBuffer<T>(memory_, size + size / 2);
    device_.grow(host_.size());
    return host_.data();
  }
  template <class D>
  void upload(D& device, std::size_t size) {
    if (size > 0) device.copy_to_device(device_.data(), host_.data(), size);
  }
  template <class D>
  void upload(D& device, std::span<const T> from) {
    std::copy(from.begin(), from.end(), image(from.size()));
    upload(device, from.size());
  }
  const T* data() const { return device_.data(); }

 private:
  exec::Memory& memory_;
  exec::Buffer<T> device_;
  exec::PinnedBuffer<T> host_;
};

}  // namespace fathom::device
