// The set of known pairs: a hash table of 64-bit keys with linear probing, no tombstones.
#pragma once

#include <cstdint>
#include <vector>

namespace fathom::native {

class PairSet {
 public:
  bool contains(std::uint32_t a, std::uint32_t b) const {
    if (keys_.empty()) return false;
    const std::uint64_t key = make_key(a, b);
    for (std::size_t i = home(key);; i = (i + 1) & mask_) {
      if (keys_[i] == key) return true;
      if (keys_[i] == 0) return false;
    }
  }

  /// Fetches the memory that the other functions will look at first.
  void prefetch(std::uint32_t a, std::uint32_t b) const {
    if (!keys_.empty()) __builtin_prefetch(&keys_[home(make_key(a, b))]);
  }

  void insert(std::uint32_t a, std::uint32_t b) {
    if ((count_ + 1) * 4 > keys_.size() * 3) grow();
    place(make_key(a, b));
    ++count_;
  }

  /// Removes a pair that is there, moving later entries of its run up (Knuth, vol. 3, 6.4, algorithm R).
  void erase(std::uint32_t a, std::uint32_t b) {
    const std::uint64_t key = make_key(a, b);
    std::size_t hole = home(key);
    while (keys_[hole] != key) hole = (hole + 1) & mask_;
    for (std::size_t i = (hole + 1) & mask_; keys_[i] != 0; i = (i + 1) & mask_) {
      const std::size_t wanted = home(keys_[i]);
      if (((i - wanted) & mask_) < ((i - hole) & mask_)) continue;
      keys_[hole] = keys_[i];
      hole = i;
    }
    keys_[hole] = 0;
    --count_;
  }

  std::size_t size() const { return count_; }
  std::size_t memory_bytes() const { return keys_.capacity() * sizeof(std::uint64_t); }

 private:
  // A pair is of two different slots, so its larger slot is not 0 and neither is the key.
  static std::uint64_t make_key(std::uint32_t a, std::uint32_t b) {
    return a < b ? static_cast<std::uint64_t>(b) << 32 | a : static_cast<std::uint64_t>(a) << 32 | b;
  }
  std::size_t home(std::uint64_t key) const {
    return static_cast<std::size_t>((key * 0x9e3779b97f4a7c15ull) >> shift_);
  }
  void place(std::uint64_t key) {
    std::size_t i = home(key);
    while (keys_[i] != 0) i = (i + 1) & mask_;
    keys_[i] = key;
  }
  void grow() {
    std::vector<std::uint64_t> old(keys_.empty() ? 64 : keys_.size() * 2, 0);
    old.swap(keys_);
    mask_ = keys_.size() - 1;
    shift_ = 64;
    for (std::size_t n = keys_.size(); n > 1; n >>= 1) --shift_;
    for (const std::uint64_t key : old)
      if (key != 0) place(key);
  }

  std::vector<std::uint64_t> keys_;
  std::size_t count_ = 0;
  std::size_t mask_ = 0;
  int shift_ = 64;
};

}  // namespace fathom::native
