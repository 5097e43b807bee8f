// Working memory shared by sorts, scans and reductions. The queue runs in order, so one scratch serves all.
#pragma once

#include <cstddef>

#include "exec/buffer.hpp"

namespace fathom::exec {

class Scratch {
 public:
  explicit Scratch(Memory& memory) : bytes_(memory) {}

  /// Makes room for a primitive that needs `bytes` (`device.sort_scratch_bytes<K>(capacity)` and the like).
  void reserve(std::size_t bytes, Where where = Where::current()) { bytes_.grow(bytes, Contents::drop, where); }

  /// The first `bytes`; throws if too little was reserved. Submissions never allocate.
  std::byte* take(std::size_t bytes, const Where& where) {
    if (bytes > bytes_.size()) {
      throw DeviceError(ErrorCode::capacity, "scratch holds only " + bytes_text(bytes_.size()) + "; reserve more",
                        bytes, where);
    }
    return bytes_.data();
  }

 private:
  Buffer<std::byte> bytes_;
};

/// Divides scratch memory into arrays, each aligned for any access. With a null base it only measures.
class ScratchCutter {
 public:
  explicit ScratchCutter(std::byte* base) : base_(base) {}

  template <class T>
  T* cut(std::size_t count) {
    constexpr std::size_t alignment = 256;  // alignment of device allocators; CUB requires it
    T* const array = base_ ? reinterpret_cast<T*>(base_ + used_) : nullptr;
    used_ += (count * sizeof(T) + alignment - 1) / alignment * alignment;
    return array;
  }
  std::size_t used() const { return used_; }

 private:
  std::byte* base_;
  std::size_t used_ = 0;
};

}  // namespace fathom::exec
