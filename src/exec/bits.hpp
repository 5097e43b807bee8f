// Bit operations for kernels.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

namespace fathom::exec {

/// Number of set bits.
FATHOM_HD std::uint32_t bit_count(std::uint64_t bits) {
#if defined(__CUDA_ARCH__)
  return static_cast<std::uint32_t>(__popcll(bits));
#else
  return static_cast<std::uint32_t>(__builtin_popcountll(bits));
#endif
}

/// Index of the lowest set bit; `bits` is not zero.
FATHOM_HD std::uint32_t lowest_bit(std::uint64_t bits) {
#if defined(__CUDA_ARCH__)
  return static_cast<std::uint32_t>(__ffsll(static_cast<long long>(bits)) - 1);
#else
  return static_cast<std::uint32_t>(__builtin_ctzll(bits));
#endif
}

}  // namespace fathom::exec
