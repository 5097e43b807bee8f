// Random numbers that are the same on every machine.
#pragma once

#include <cstdint>

namespace fathom {

/// SplitMix64 (Steele, Lea and Flood 2014): a counter in steps of the golden ratio, mixed. Replaces the standard
/// library's distributions, which differ between implementations.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }

  /// Uniform in [0, 1), a multiple of 2⁻⁵³.
  double unit() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

  /// Uniform in [−limit, limit).
  double symmetric(double limit) { return limit * (2.0 * unit() - 1.0); }

 private:
  std::uint64_t state_;
};

}  // namespace fathom
