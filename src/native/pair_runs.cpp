#include "native/pair_runs.hpp"

#include <algorithm>
#include <utility>

#include "native/prefetch.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

constexpr std::size_t few = 128;  // pairs; one thread gathers fewer faster
constexpr std::size_t slot_grain = 128;

}  // namespace

void PairRuns::make_room(std::size_t lists, std::size_t slots) {
  if (lists_.size() < lists) lists_.resize(lists);
  if (list_sizes_.size() < lists) grow_to(list_sizes_, lists);
  if (runs_.size() < slots) grow_to(runs_, slots);
}

void PairRuns::gather(std::size_t lists, std::span<const std::uint32_t> slots, ThreadPool& pool,
                      std::vector<Pair>& pairs) {
  std::size_t count = 0;
  with_pairs_.clear();
  for (std::uint32_t i = 0; i < lists; ++i) {
    if (list_sizes_[i] == 0) continue;
    count += list_sizes_[i];
    prefetch_to_read(&lists_[i]);
    with_pairs_.push_back(i);
  }
  if (is_of_a_burst(pairs, count)) std::vector<Pair>().swap(pairs);
  if (count < few) return gather_few(count, pairs);

  grow_to(pairs, count);
  offsets_.assign((slots.size() + slot_grain - 1) / slot_grain, 0);
  pool.for_each_chunk(slots.size(), slot_grain, [&](std::size_t begin, std::size_t end) {
    std::size_t sum = 0;
    for (std::size_t i = begin; i < end; ++i) sum += runs_[slots[i]].count;
    offsets_[begin / slot_grain] = sum;
  });
  std::size_t sum = 0;
  for (std::size_t& offset : offsets_) sum += std::exchange(offset, sum);
  pool.for_each_chunk(slots.size(), slot_grain, [&](std::size_t begin, std::size_t end) {
    constexpr std::size_t ahead = 8;
    Pair* to = pairs.data() + offsets_[begin / slot_grain];
    const auto first = [&](const Run& run) { return lists_[run.list].data() + run.first; };
    for (std::size_t i = begin; i < end; ++i) {
      if (i + ahead < end && runs_[slots[i + ahead]].count > 0) prefetch_to_read(first(runs_[slots[i + ahead]]));
      const Run run = runs_[slots[i]];
      if (run.count > 0) to = std::copy_n(first(run), run.count, to);
    }
  });
}

void PairRuns::gather_few(std::size_t count, std::vector<Pair>& pairs) {
  for (const std::uint32_t list : with_pairs_) prefetch_to_read(lists_[list].data());
  pairs.clear();
  fathom::make_room(pairs, count);
  for (const std::uint32_t list : with_pairs_)
    for (const Pair pair : lists_[list]) {
      std::size_t index = pairs.size();
      pairs.push_back(pair);
      for (; index > 0 && pairs[index - 1].a > pair.a; --index) pairs[index] = pairs[index - 1];
      pairs[index] = pair;
    }
}

std::size_t PairRuns::memory_bytes() const {
  return runs_.capacity() * sizeof(Run) + lists_.capacity() * sizeof(lists_[0]) +
         (list_sizes_.capacity() + with_pairs_.capacity()) * sizeof(std::uint32_t) +
         offsets_.capacity() * sizeof(std::size_t);
}

}  // namespace fathom::native
