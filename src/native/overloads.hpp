// Bodies whose contacts carry more than sweeps can hold.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace fathom::native {

/// Marks by slot, written by all threads as impulses are stored.
class Overloads {
 public:
  void resize(std::size_t slots) {
    if (marks_.size() < slots) marks_.resize(slots, 0);
  }
  void mark(std::uint32_t slot) {
    std::atomic_ref(marks_[slot]).store(1, std::memory_order_relaxed);
    any_.store(true, std::memory_order_relaxed);
  }
  bool any() const { return any_.load(std::memory_order_relaxed); }
  bool is_marked(std::uint32_t slot) const { return slot < marks_.size() && marks_[slot] != 0; }
  void clear() {
    if (any()) std::fill(marks_.begin(), marks_.end(), std::uint8_t{0});
    any_.store(false, std::memory_order_relaxed);
  }
  std::size_t memory_bytes() const { return marks_.capacity(); }

  template <class Self, class Archive>
  static void archive(Self& s, Archive& a) {
    a(s.marks_);
  }
  void restored() { any_ = std::find(marks_.begin(), marks_.end(), 1) != marks_.end(); }

 private:
  std::vector<std::uint8_t> marks_;  // by slot
  std::atomic<bool> any_ = false;
};

}  // namespace fathom::native
