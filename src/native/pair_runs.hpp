// Pairs that many threads find, body by body, brought into the order of bodies.
//
// All pairs that one body finds lie one after the other in the list of who searched. So where each body's begin is
// counted out, and every thread copies those of some bodies: nothing is sorted.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/broad_phase.hpp"
#include "world/large_array.hpp"

namespace fathom::native {

class PairRuns {
 public:
  /// Lists of pairs (a, b), to be filled by any thread that clears the list first; each list is one thread's.
  std::vector<std::vector<Pair>>& lists() { return lists_; }
  void make_room(std::size_t lists, std::size_t slots);
  /// What `slot` found, as a, are the `count` pairs of the list from `first` on.
  void note(std::uint32_t slot, std::size_t list, std::size_t first, std::size_t count) {
    runs_[slot] = {static_cast<std::uint32_t>(list), static_cast<std::uint32_t>(first),
                   static_cast<std::uint32_t>(count)};
  }
  /// All that the list got.
  void note_list(std::size_t list, std::size_t pairs) { list_sizes_[list] = static_cast<std::uint32_t>(pairs); }

  /// Of the first `lists` lists and of the bodies `slots`, each of which is noted, in their order.
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
  std::vector<std::size_t> offsets_;       // where pairs of each chunk of slots begin
};

}  // namespace fathom::native
