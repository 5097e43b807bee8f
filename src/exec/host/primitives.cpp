#include "exec/host/primitives.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace fathom::exec::host {

namespace {

constexpr int digit_bits = 8;
constexpr std::uint32_t digits = 1u << digit_bits;

template <class Key>
struct Items {
  Key* keys;
  std::uint32_t* values;
};

template <class Key>
std::uint32_t digit_of(Key key, int shift, std::uint32_t mask) {
  return static_cast<std::uint32_t>(key >> shift) & mask;
}

template <class Key>
void count_digits(ThreadPool& pool, const Key* keys, std::uint32_t n, int shift, std::uint32_t mask,
                  std::uint32_t* counters) {
  pool.for_each_chunk(n, chunk_items, [=](std::size_t begin, std::size_t end) {
    std::array<std::uint32_t, digits> count{};
    for (std::size_t i = begin; i < end; ++i) ++count[digit_of(keys[i], shift, mask)];
    std::copy(count.begin(), count.end(), counters + begin / chunk_items * digits);
  });
}

/// Converts counts to the index of each chunk's first item of each digit; false if all items share one digit.
bool counts_to_indices(std::uint32_t* counters, std::size_t chunks, std::uint32_t n) {
  std::uint32_t index = 0;
  for (std::uint32_t digit = 0; digit < digits; ++digit) {
    const std::uint32_t first = index;
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
      index += std::exchange(counters[chunk * digits + digit], index);
    }
    if (index - first == n) return false;
  }
  return true;
}

template <class Key>
void scatter(ThreadPool& pool, Items<Key> from, Items<Key> to, std::uint32_t n, int shift, std::uint32_t mask,
             const std::uint32_t* counters) {
  pool.for_each_chunk(n, chunk_items, [=](std::size_t begin, std::size_t end) {
    std::array<std::uint32_t, digits> indices;
    std::copy_n(counters + begin / chunk_items * digits, digits, indices.begin());
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t index = indices[digit_of(from.keys[i], shift, mask)]++;
      to.keys[index] = from.keys[i];
      to.values[index] = from.values[i];
    }
  });
}

/// Writes the sum before each chunk to sums[chunk], and returns the total.
template <class CountChunk>
std::uint32_t sum_before_chunks(ThreadPool& pool, std::uint32_t* sums, std::uint32_t n, CountChunk count_chunk) {
  pool.for_each_chunk(n, chunk_items,
                      [=](std::size_t begin, std::size_t end) { sums[begin / chunk_items] = count_chunk(begin, end); });
  std::uint32_t sum = 0;
  for (std::size_t chunk = 0; chunk < chunk_count(n); ++chunk) sum += std::exchange(sums[chunk], sum);
  return sum;
}

}  // namespace

template <class Key>
void radix_sort(ThreadPool& pool, const SortScratch<Key>& scratch, std::uint32_t n, Key* keys, std::uint32_t* values,
                int key_bits) {
  Items<Key> from{keys, values}, to{scratch.keys, scratch.values};
  for (int shift = 0; shift < key_bits; shift += digit_bits) {
    const std::uint32_t mask = (1u << std::min(digit_bits, key_bits - shift)) - 1;
    count_digits(pool, from.keys, n, shift, mask, scratch.counters);
    if (!counts_to_indices(scratch.counters, chunk_count(n), n)) continue;
    scatter(pool, from, to, n, shift, mask, scratch.counters);
    std::swap(from, to);
  }
  if (from.keys == keys) return;
  pool.for_each_chunk(n, chunk_items, [=](std::size_t begin, std::size_t end) {
    std::copy(from.keys + begin, from.keys + end, keys + begin);
    std::copy(from.values + begin, from.values + end, values + begin);
  });
}
template void radix_sort(ThreadPool&, const SortScratch<std::uint32_t>&, std::uint32_t, std::uint32_t*, std::uint32_t*,
                         int);
template void radix_sort(ThreadPool&, const SortScratch<std::uint64_t>&, std::uint32_t, std::uint64_t*, std::uint32_t*,
                         int);

std::uint32_t exclusive_scan(ThreadPool& pool, std::uint32_t* sums, std::uint32_t n, const std::uint32_t* in,
                             std::uint32_t* out) {
  const std::uint32_t total = sum_before_chunks(pool, sums, n, [in](std::size_t begin, std::size_t end) {
    std::uint32_t sum = 0;
    for (std::size_t i = begin; i < end; ++i) sum += in[i];
    return sum;
  });
  pool.for_each_chunk(n, chunk_items, [=](std::size_t begin, std::size_t end) {
    std::uint32_t sum = sums[begin / chunk_items];
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t term = in[i];
      out[i] = sum;
      sum += term;
    }
  });
  return total;
}

std::uint32_t select(ThreadPool& pool, std::uint32_t* sums, std::uint32_t n, const std::uint32_t* flags,
                     std::uint32_t* indices) {
  const std::uint32_t total = sum_before_chunks(pool, sums, n, [flags](std::size_t begin, std::size_t end) {
    std::uint32_t sum = 0;
    for (std::size_t i = begin; i < end; ++i) sum += flags[i] != 0;
    return sum;
  });
  pool.for_each_chunk(n, chunk_items, [=](std::size_t begin, std::size_t end) {
    std::uint32_t index = sums[begin / chunk_items];
    for (std::size_t i = begin; i < end; ++i) {
      if (flags[i] != 0) indices[index++] = static_cast<std::uint32_t>(i);
    }
  });
  return total;
}

}  // namespace fathom::exec::host
