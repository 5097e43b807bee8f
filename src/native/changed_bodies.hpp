// Bodies with new fat boxes: those that the last step moved out of their boxes, and those edited since.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/body_state.hpp"
#include "threads/thread_pool.hpp"

namespace fathom::native {

class ChangedBodies {
 public:
  /// Collects all bodies flagged `box_changed`.
  void collect(std::span<const std::uint8_t> flags, ThreadPool& pool);
  /// Their slots, ascending.
  std::span<const std::uint32_t> slots() const { return {slots_.data(), count_}; }
  /// Whether some of them are not awake.
  bool any_at_rest() const { return any_at_rest_; }
  std::size_t memory_bytes() const { return slots_.capacity() * sizeof(std::uint32_t); }

 private:
  struct Found {
    std::uint32_t count = 0;
    bool at_rest = false;
  };
  std::vector<std::uint32_t> slots_;  // room for all bodies
  std::vector<Found> found_;          // per chunk
  std::size_t count_ = 0;
  bool any_at_rest_ = false;
};

}  // namespace fathom::native
