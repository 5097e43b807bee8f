// Arrays that grow during use and may become large. They have their own pages, and growing remaps these instead of
// copying. A vector that grows step by step to 4 MB requests five times that from the system, page fault by page fault,
// while other threads wait for the one that grows it. From 2 MB on, arrays are aligned to huge pages and request them:
// contacts and manifolds are read in random order, and a core's TLB covers only about a thousand small pages.
#pragma once

#include <cstddef>
#include <cstring>
#include <new>
#include <type_traits>
#include <utility>

#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__)
#include <sys/mman.h>

#include <cstdint>
#define FATHOM_HAS_MREMAP
#endif

namespace fathom {

/// Trivially copyable objects, aligned to a cache line. New elements are uninitialised.
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
  /// Frees all memory.
  void reset() {
    release(data_, capacity_);
    data_ = nullptr;
    size_ = capacity_ = 0;
  }

 private:
  static constexpr std::align_val_t alignment{64};
  static constexpr std::size_t min_to_map = 65536;  // bytes
  static bool is_mapped([[maybe_unused]] std::size_t capacity) {
#ifdef FATHOM_HAS_MREMAP
    return capacity * sizeof(T) >= min_to_map;
#else
    return false;
#endif
  }

  static T* grown(T* old, std::size_t old_capacity, std::size_t capacity) {
#ifdef FATHOM_HAS_MREMAP
    if (is_mapped(capacity)) {
      const std::size_t now = mapped_bytes(capacity);
      void* memory = mapped(now);
      if (is_mapped(old_capacity))
        memory = mremap(old, mapped_bytes(old_capacity), now, MREMAP_MAYMOVE | MREMAP_FIXED, memory);
      else
        take_over(static_cast<T*>(memory), old, old_capacity);
      if (memory == MAP_FAILED) throw std::bad_alloc();
      if (now >= huge_page) madvise(memory, now, MADV_HUGEPAGE);  // a hint: without huge pages it is only slower
      return static_cast<T*>(memory);
    }
#endif
    T* const memory = static_cast<T*>(::operator new(capacity * sizeof(T), alignment));
    take_over(memory, old, old_capacity);
    return memory;
  }
#ifdef FATHOM_HAS_MREMAP
  static constexpr std::size_t huge_page = std::size_t{1} << 21;
  static constexpr std::size_t page = 65536;  // the largest page size of any processor
  static std::size_t mapped_bytes(std::size_t capacity) { return (capacity * sizeof(T) + page - 1) / page * page; }
  static void* mapped(std::size_t bytes) {
    const std::size_t slack = bytes >= huge_page ? huge_page : 0;
    void* const memory = mmap(nullptr, bytes + slack, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    if (slack == 0) return memory;
    // Unmaps what precedes the first huge page, and what follows the array.
    char* const first = static_cast<char*>(memory);
    const std::size_t before = -reinterpret_cast<std::uintptr_t>(first) % huge_page;
    if (before > 0) munmap(first, before);
    if (before < slack) munmap(first + before + bytes, slack - before);
    return first + before;
  }
#endif
  static void take_over(T* to, T* old, std::size_t capacity) {
    if (capacity > 0) std::memcpy(static_cast<void*>(to), old, capacity * sizeof(T));
    release(old, capacity);
  }
  static void release(T* data, [[maybe_unused]] std::size_t capacity) {
    if (!data) return;
#ifdef FATHOM_HAS_MREMAP
    if (is_mapped(capacity)) {
      munmap(data, mapped_bytes(capacity));
      return;
    }
#endif
    ::operator delete(data, alignment);
  }

  T* data_ = nullptr;
  std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace fathom
