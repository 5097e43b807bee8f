// Pairs found by many threads, body by body, gathered in the order of bodies.
//
// All pairs found by one body are consecutive in the searching thread's list. So the position of each body's pairs can
// be counted, and every thread copies the pairs of some bodies. Nothing is sorted.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/broad_phase.hpp"
#include "world/large_array.hpp"

namespace fathom::native {

class PairRuns {
 public:
  /// Lists of pairs (a, b), to be filled by any thread, which clears its list first; one thread per list.
  std::vector<std::vector<Pair>>& lists() { return lists_; }
  void make_room(std::size_t lists, std::size_t slots);
  /// `slot`, as a, found the `count` pairs of the list from `first` on.
  void note(std::uint32_t slot, std::size_t list, std::size_t first, std::size_t count) {
    runs_[slot] = {static_cast<std::uint32_t>(list), static_cast<std::uint32_t>(first),
                   static_cast<std::uint32_t>(count)};
  }
  /// Number of pairs in the list.
  void note_list(std::size_t list, std::size_t pairs) { list_sizes_[list] = static_cast<std::uint32_t>(pairs); }

  /// Gathers the pairs of the first `lists` lists in the order of `slots`, each of which must have been noted.
  void gather(std::size_t lists, std::span<const std::uint32_t> slots, ThreadPool& pool, std::vector<Pair>& pairs);

  std::size_t memory_bytes() const;

 private:
  struct Run {
    std::uint32_t list, first, count;
  };

  void gather_few(std::size_t count, std::vector<Pair>& pairs);

  std::vector<std::vector<Pair>> lists_;
  std::vector<std::uint32_t> list_sizes_;
  std::vector<std::uint32_t> with_pairs_;  // lists
  LargeArray<Run> runs_;                   // by slot
  std::vector<std::size_t> offsets_;       // where each chunk of slots' pairs begin
};

}  // namespace fathom::native
