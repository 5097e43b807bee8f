// The set of known pairs: hash tables of 64-bit keys with linear probing, no tombstones. A pair's hash selects its
// table, so that several threads can fill the set, each its own tables.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

namespace fathom::native {

class PairSet {
 public:
  static constexpr std::size_t tables = 64;

  bool contains(std::uint32_t a, std::uint32_t b) const {
    const std::uint64_t key = make_key(a, b), hash = hashed(key);
    const Table& table = tables_[hash >> table_shift];
    if (table.keys.empty()) return false;
    for (std::size_t i = table.home(hash);; i = (i + 1) & table.mask) {
      if (table.keys[i] == key) return true;
      if (table.keys[i] == 0) return false;
    }
  }

  /// Prefetches what the other functions read first.
  void prefetch(std::uint32_t a, std::uint32_t b) const {
    const std::uint64_t hash = hashed(make_key(a, b));
    const Table& table = tables_[hash >> table_shift];
    if (!table.keys.empty()) __builtin_prefetch(&table.keys[table.home(hash)]);
  }

  /// The table that does or would contain the pair.
  static std::size_t table(std::uint32_t a, std::uint32_t b) { return hashed(make_key(a, b)) >> table_shift; }

  /// Inserts a new pair. Threads may insert and erase concurrently in different tables.
  void insert(std::uint32_t a, std::uint32_t b) {
    const std::uint64_t key = make_key(a, b), hash = hashed(key);
    Table& table = tables_[hash >> table_shift];
    if ((table.count + 1) * 4 > table.keys.size() * 3) {
      const std::size_t before = table.keys.size();
      table.grow();
      std::atomic_ref(room_).fetch_add(table.keys.size() - before, std::memory_order_relaxed);
    }
    table.put(key, hash);
    ++table.count;
  }

  /// Removes a pair that is in the set, moving later entries of its run up (Knuth, vol. 3, 6.4, algorithm R).
  void erase(std::uint32_t a, std::uint32_t b) {
    const std::uint64_t key = make_key(a, b), hash = hashed(key);
    Table& table = tables_[hash >> table_shift];
    std::vector<std::uint64_t>& keys = table.keys;
    const std::size_t mask = table.mask;
    std::size_t hole = table.home(hash);
    while (keys[hole] != key) hole = (hole + 1) & mask;
    for (std::size_t i = (hole + 1) & mask; keys[i] != 0; i = (i + 1) & mask) {
      const std::size_t wanted = table.home(hashed(keys[i]));
      if (((i - wanted) & mask) < ((i - hole) & mask)) continue;
      keys[hole] = keys[i];
      hole = i;
    }
    keys[hole] = 0;
    --table.count;
  }

  std::size_t size() const {
    std::size_t sum = 0;
    for (const Table& table : tables_) sum += table.count;
    return sum;
  }
  std::size_t memory_bytes() const { return room_ * sizeof(std::uint64_t); }

 private:
  static constexpr int table_shift = 64 - 6;
  static_assert(tables == std::size_t{1} << (64 - table_shift));

  struct alignas(64) Table {
    std::vector<std::uint64_t> keys;
    std::size_t count = 0;
    std::size_t mask = 0;
    int shift = 0;

    // By the bits of the hash below those that select the table.
    std::size_t home(std::uint64_t hash) const { return static_cast<std::size_t>((hash << 6) >> shift); }
    void put(std::uint64_t key, std::uint64_t hash) {
      std::size_t i = home(hash);
      while (keys[i] != 0) i = (i + 1) & mask;
      keys[i] = key;
    }
    void grow() {
      std::vector<std::uint64_t> old(keys.empty() ? 8 : keys.size() * 2, 0);
      old.swap(keys);
      mask = keys.size() - 1;
      shift = 64;
      for (std::size_t n = keys.size(); n > 1; n >>= 1) --shift;
      for (const std::uint64_t key : old)
        if (key != 0) put(key, hashed(key));
    }
  };

  // A pair has two different slots, so its larger slot is not 0, and neither is the key.
  static std::uint64_t make_key(std::uint32_t a, std::uint32_t b) {
    return a < b ? static_cast<std::uint64_t>(b) << 32 | a : static_cast<std::uint64_t>(a) << 32 | b;
  }
  static std::uint64_t hashed(std::uint64_t key) { return key * 0x9e3779b97f4a7c15ull; }

  std::array<Table, tables> tables_;
  std::size_t room_ = 0;  // keys of all tables, each of which is in the cache of the thread that changed it
};

}  // namespace fathom::native
