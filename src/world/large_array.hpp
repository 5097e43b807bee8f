// Arrays that grow while they are in use and may become large: they lie in pages of their own, which growing moves in
// the address space instead of copying them. A vector that grows step by step to 4 MB fetches five times that from the
// system, page fault by page fault, and it is the one thread that grows it who waits.
#pragma once

#include <cstddef>
#include <cstring>
#include <new>
#include <type_traits>
#include <utility>

#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__)
#include <sys/mman.h>
#define FATHOM_HAS_MREMAP
#endif

namespace fathom {

/// Plain objects, aligned to a cache line. New ones hold anything until they are assigned.
template <class T>
class LargeArray {
 public:
  static_assert(std::is_trivially_copyable_v<T> && alignof(T) <= 64);

  LargeArray() = default;
  ~LargeArray() { release(data_, capacity_); }
  LargeArray(const LargeArray&) = delete;
  LargeArray& operator=(const LargeArray&) = delete;

  T& operator[](std::size_t i) { return data_[i]; }
  const T& operator[](std::size_t i) const { return data_[i]; }
  T* data() { return data_; }
  const T* data() const { return data_; }
  T* begin() { return data_; }
  T* end() { return data_ + size_; }
  const T* begin() const { return data_; }
  const T* end() const { return data_ + size_; }
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  std::size_t capacity() const { return capacity_; }

  void reserve(std::size_t capacity) {
    if (capacity <= capacity_) return;
    data_ = grown(data_, capacity_, capacity);
    capacity_ = capacity;
  }
  void resize(std::size_t size) {
    reserve(size);
    size_ = size;
  }
  void clear() { size_ = 0; }
  /// Gives back all room.
  void reset() {
    release(data_, capacity_);
    data_ = nullptr;
    size_ = capacity_ = 0;
  }

 private:
  static constexpr std::align_val_t alignment{64};
  static constexpr std::size_t least_to_map = 65536;  // bytes
  static bool is_mapped([[maybe_unused]] std::size_t capacity) {
#ifdef FATHOM_HAS_MREMAP
    return capacity * sizeof(T) >= least_to_map;
#else
    return false;
#endif
  }

  static T* grown(T* old, std::size_t old_capacity, std::size_t capacity) {
#ifdef FATHOM_HAS_MREMAP
    if (is_mapped(capacity)) {
      const std::size_t before = old_capacity * sizeof(T), now = capacity * sizeof(T);
      const bool moves = is_mapped(old_capacity);
      void* const memory = moves ? mremap(old, before, now, MREMAP_MAYMOVE)
                                 : mmap(nullptr, now, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
      if (memory == MAP_FAILED) throw std::bad_alloc();
      if (!moves) take_over(static_cast<T*>(memory), old, old_capacity);
      return static_cast<T*>(memory);
    }
#endif
    T* const memory = static_cast<T*>(::operator new(capacity * sizeof(T), alignment));
    take_over(memory, old, old_capacity);
    return memory;
  }
  static void take_over(T* to, T* old, std::size_t capacity) {
    if (capacity > 0) std::memcpy(static_cast<void*>(to), old, capacity * sizeof(T));
    release(old, capacity);
  }
  static void release(T* data, [[maybe_unused]] std::size_t capacity) {
    if (!data) return;
#ifdef FATHOM_HAS_MREMAP
    if (is_mapped(capacity)) {
      munmap(data, capacity * sizeof(T));
      return;
    }
#endif
    ::operator delete(data, alignment);
  }

  T* data_ = nullptr;
  std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace fathom
