// Typed memory that frees itself: on the device, and pinned on the host for staging.
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>

#include "exec/memory.hpp"

namespace fathom::exec {

/// Bytes of `count` items; throws if that exceeds the address space.
template <class T>
std::size_t bytes_of(std::size_t count, const Where& where) {
  if (count > std::numeric_limits<std::size_t>::max() / sizeof(T)) {
    throw DeviceError(ErrorCode::capacity, "more items than an address can span",
                      std::numeric_limits<std::size_t>::max(), where);
  }
  return count * sizeof(T);
}

/// What happens to a buffer's items when it grows.
enum class Contents { drop, keep };

/// `size` items of device memory, uninitialised. Kernels take its `data()`. Must not outlive its device.
template <class T>
class Buffer {
  static_assert(std::is_trivially_copyable_v<T>, "items travel as bytes");

 public:
  explicit Buffer(Memory& memory) : memory_(&memory) {}
  Buffer(Memory& memory, std::size_t size, Where where = Where::current()) : memory_(&memory) {
    grow(size, Contents::drop, where);
  }
  Buffer(Buffer&& other) noexcept
      : memory_(other.memory_), data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  Buffer& operator=(Buffer&& other) noexcept {
    std::swap(memory_, other.memory_);
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  ~Buffer() {
    if (data_) memory_->release(data_, size_ * sizeof(T));
  }

  /// Makes room for at least `size` items; a larger buffer stays as it is. If it throws, nothing has changed.
  /// Graphs recorded with the old address must be recorded again.
  void grow(std::size_t size, Contents contents = Contents::drop, Where where = Where::current()) {
    if (size <= size_) return;
    const std::size_t bytes = bytes_of<T>(size, where);
    Buffer larger(*memory_);
    larger.data_ = static_cast<T*>(memory_->allocate(bytes, where));
    larger.size_ = size;
    if (contents == Contents::keep && size_ != 0) memory_->copy_bytes(larger.data_, data_, size_ * sizeof(T), where);
    *this = std::move(larger);  // `larger` now owns the old memory; its release waits for the copy
  }

  T* data() { return data_; }
  const T* data() const { return data_; }
  std::size_t size() const { return size_; }
  std::size_t bytes() const { return size_ * sizeof(T); }

 private:
  Memory* memory_;
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// `size` items of pinned host memory, value-initialised: the host's end of asynchronous copies.
template <class T>
class PinnedBuffer {
  static_assert(std::is_trivially_copyable_v<T>, "items travel as bytes");

 public:
  PinnedBuffer(Memory& memory, std::size_t size, Where where = Where::current()) : memory_(&memory), size_(size) {
    if (size == 0) return;
    data_ = static_cast<T*>(memory.allocate_pinned(bytes_of<T>(size, where), where));
    for (std::size_t i = 0; i < size; ++i) ::new (data_ + i) T();
  }
  PinnedBuffer(PinnedBuffer&& other) noexcept
      : memory_(other.memory_), data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  PinnedBuffer& operator=(PinnedBuffer&& other) noexcept {
    std::swap(memory_, other.memory_);
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  ~PinnedBuffer() {
    if (data_) memory_->release_pinned(data_);
  }

  T* data() { return data_; }
  const T* data() const { return data_; }
  std::size_t size() const { return size_; }
  T& operator[](std::size_t i) { return data_[i]; }
  const T& operator[](std::size_t i) const { return data_[i]; }
  T* begin() { return data_; }
  T* end() { return data_ + size_; }
  const T* begin() const { return data_; }
  const T* end() const { return data_ + size_; }

 private:
  Memory* memory_;
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace fathom::exec
