// Bits of words, in kernels.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

namespace fathom::exec {

/// How many bits are set.
FATHOM_HD std::uint32_t bit_count(std::uint64_t bits) {
#if defined(__CUDA_ARCH__)
  return static_cast<std::uint32_t>(__popcll(bits));
#else
  return static_cast<std::uint32_t>(__builtin_popcountll(bits));
#endif
}

/// The lowest bit that is set; some bit is.
FATHOM_HD std::uint32_t lowest_bit(std::uint64_t bits) {
#if defined(__CUDA_ARCH__)
  return static_cast<std::uint32_t>(__ffsll(static_cast<long long>(bits)) - 1);
#else
  return static_cast<std::uint32_t>(__builtin_ctzll(bits));
#endif
}

}  // namespace fathom::exec
