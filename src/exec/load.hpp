// Loads that a GPU may serve from a cache that barriers do not flush.
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

/// Whether work-items may wait for data that others write while the kernel runs: requires that all of them be resident,
/// and that 16-byte accesses be single.
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
inline constexpr bool can_wait_for_data = true;
#else
inline constexpr bool can_wait_for_data = false;
#endif

/// Loads a quad that another work-item may be writing: the result is from a single store.
template <class Quad>
FATHOM_HD Quad load_shared_quad(const Quad& from) {
  static_assert(sizeof(Quad) == 16 && alignof(Quad) == 16);
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
  Quad q;
  asm volatile(
      "{ .reg .b128 all; .reg .b64 low, high;"
      "ld.relaxed.gpu.global.b128 all, [%4]; mov.b128 {low, high}, all;"
      "mov.b64 {%0, %1}, low; mov.b64 {%2, %3}, high; }"
      : "=f"(q.x), "=f"(q.y), "=f"(q.z), "=f"(q.w)
      : "l"(&from)
      : "memory");
  return q;
#else
  return from;
#endif
}

/// Whether all work-items of the active warp are ready. One that waited for its data alone would diverge from its warp
/// for good.
FATHOM_HD bool all_ready(bool ready) {
#if defined(__CUDA_ARCH__)
  return __all_sync(__activemask(), ready);
#else
  return ready;
#endif
}

/// Limits how long a work-item waits for data. Data that never comes, because of a counting error, must not hang the
/// GPU forever: after some seconds the kernel traps, and the host sees that the device is lost.
class Patience {
 public:
  /// Call it after every unsuccessful poll, which takes more than half a microsecond.
  FATHOM_HD void look_again() {
#if defined(__CUDA_ARCH__)
    if (++looks_ == max_looks) __trap();
#endif
  }

 private:
  static constexpr std::uint32_t max_looks = 1u << 22;
  [[maybe_unused]] std::uint32_t looks_ = 0;  // used on GPUs
};

template <class Quad>
FATHOM_HD void store_shared_quad(Quad& to, const Quad& q) {
  static_assert(sizeof(Quad) == 16 && alignof(Quad) == 16);
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
  asm volatile(
      "{ .reg .b128 all; .reg .b64 low, high;"
      "mov.b64 low, {%1, %2}; mov.b64 high, {%3, %4}; mov.b128 all, {low, high};"
      "st.relaxed.gpu.global.b128 [%0], all; }" ::"l"(&to),
      "f"(q.x), "f"(q.y), "f"(q.z), "f"(q.w)
      : "memory");
#else
  to = q;
#endif
}

}  // namespace fathom::exec
