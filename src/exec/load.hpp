// Loads that a GPU may serve from a cache which barriers do not empty.
#pragma once

#include <cstdint>
#include <type_traits>

#include "fathom/math.hpp"

namespace fathom::exec {

/// The value of `x`, which nothing writes while the kernel runs.
template <class T>
FATHOM_HD T load_unchanging(const T& x) {
  static_assert(std::is_trivially_copyable_v<T>);
#if defined(__CUDA_ARCH__)
  if constexpr (sizeof(T) == 16 && alignof(T) == 16) {
    const float4 quad = __ldg(reinterpret_cast<const float4*>(&x));
    return *reinterpret_cast<const T*>(&quad);
  } else if constexpr (sizeof(T) == 8 && alignof(T) == 8) {
    const float2 pair = __ldg(reinterpret_cast<const float2*>(&x));
    return *reinterpret_cast<const T*>(&pair);
  } else if constexpr (sizeof(T) == 4) {
    const float word = __ldg(reinterpret_cast<const float*>(&x));
    return *reinterpret_cast<const T*>(&word);
  } else {
    return x;
  }
#else
  return x;
#endif
}

}  // namespace fathom::exec
