// Bodies whose contacts carry more than sweeps can hold.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace fathom::native {

/// Marks by slot, written by all threads as impulses are stored. What is overloaded in two steps on end is no hit.
class Overloads {
 public:
  void resize(std::size_t slots) {
    if (marks_.size() < slots) marks_.resize(slots, 0);
  }
  void mark(std::uint32_t slot) {
    std::atomic_ref(marks_[slot]).fetch_or(this_step, std::memory_order_relaxed);
    any_.store(true, std::memory_order_relaxed);
  }
  /// Some body was overloaded in the last step.
  bool any() const { return any_.load(std::memory_order_relaxed); }
  /// The body was, and in the step before.
  bool lasts(std::uint32_t slot) const { return slot < marks_.size() && marks_[slot] == (this_step | step_before); }
  /// Begins a step.
  void advance() {
    if (any() || had_any_)
      for (std::uint8_t& mark : marks_) mark = mark & this_step ? step_before : 0;
    had_any_ = any();
    any_.store(false, std::memory_order_relaxed);
  }
  std::size_t memory_bytes() const { return marks_.capacity(); }

  template <class Self, class Archive>
  static void archive(Self& s, Archive& a) {
    a(s.marks_);
  }
  void restored() {
    had_any_ = true;
    any_ = std::any_of(marks_.begin(), marks_.end(), [](std::uint8_t mark) { return mark & this_step; });
  }

 private:
  static constexpr std::uint8_t this_step = 1, step_before = 2;
  std::vector<std::uint8_t> marks_;
  std::atomic<bool> any_ = false;
  bool had_any_ = false;
};

}  // namespace fathom::native
