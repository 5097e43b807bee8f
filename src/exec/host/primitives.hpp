// Sort, scan and selection on a pool of threads.
//
// All divide their items into chunks of one size, count per chunk, sum the counts in chunk order, and then let each
// chunk write its own entries. Results therefore do not depend on the number of threads.
#pragma once

#include <cstddef>
#include <cstdint>

#include "exec/scratch.hpp"
#include "threads/thread_pool.hpp"

namespace fathom::exec::host {

/// Large enough that a chunk's 256 counters cost little in comparison, small enough that 100,000 items occupy many
/// threads.
inline constexpr std::size_t chunk_items = 8192;

inline std::size_t chunk_count(std::size_t items) { return (items + chunk_items - 1) / chunk_items; }

template <class Key>
struct SortScratch {
  Key* keys;  // the second half of the double buffers
  std::uint32_t* values;
  std::uint32_t* counters;  // 256 per chunk
  std::size_t bytes;

  SortScratch(std::byte* memory, std::uint32_t capacity) {
    ScratchCutter cutter(memory);
    keys = cutter.cut<Key>(capacity);
    values = cutter.cut<std::uint32_t>(capacity);
    counters = cutter.cut<std::uint32_t>(256 * chunk_count(capacity));
    bytes = cutter.used();
  }
};

/// Stable, by the lowest `key_bits` bits.
template <class Key>
void radix_sort(ThreadPool& pool, const SortScratch<Key>& scratch, std::uint32_t n, Key* keys, std::uint32_t* values,
                int key_bits);

/// Returns the total. `sums` has one word per chunk.
std::uint32_t exclusive_scan(ThreadPool& pool, std::uint32_t* sums, std::uint32_t n, const std::uint32_t* in,
                             std::uint32_t* out);

/// Returns how many were selected.
std::uint32_t select(ThreadPool& pool, std::uint32_t* sums, std::uint32_t n, const std::uint32_t* flags,
                     std::uint32_t* indices);

}  // namespace fathom::exec::host
