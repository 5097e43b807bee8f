// Atomics on 32- and 64-bit integers for kernels, relaxed, visible to the whole device; each returns the old value.
//
// Sums, minima, maxima and or-masks do not depend on the order of their operands. A slot reserved with atomic_add does:
// lists filled this way must be sorted afterwards, or results differ from run to run.
#pragma once

#include <cstdint>

#include "fathom/math.hpp"

// The build defines FATHOM_SYCL_SOURCE for sources compiled by a SYCL compiler (cmake/FathomSycl.cmake).
#if defined(FATHOM_SYCL_SOURCE)
#include <sycl/sycl.hpp>
#else
#include <atomic>
#endif

namespace fathom::exec {

namespace detail {

#if defined(__CUDA_ARCH__)
// CUDA's 64-bit atomics are declared for unsigned long long, which here is a different type from std::uint64_t.
__device__ inline std::uint32_t* cuda_word(std::uint32_t& x) { return &x; }
__device__ inline std::int32_t* cuda_word(std::int32_t& x) { return &x; }
__device__ inline unsigned long long* cuda_word(std::uint64_t& x) { return reinterpret_cast<unsigned long long*>(&x); }
#elif defined(FATHOM_SYCL_SOURCE)
// Device scope even for local memory: AdaptiveCpp compiles work-group scope to generic atomics.
template <class T>
auto atomic_ref(T& x) {
  return sycl::atomic_ref<T, sycl::memory_order::relaxed, sycl::memory_scope::device>(x);
}
#else
template <class T, class Better>
T atomic_replace_if(T& x, T value, Better better) {
  std::atomic_ref<T> word(x);
  T old = word.load(std::memory_order_relaxed);
  while (better(value, old) && !word.compare_exchange_weak(old, value, std::memory_order_relaxed)) {
  }
  return old;
}
#endif

}  // namespace detail

/// T is std::uint32_t, std::int32_t or std::uint64_t throughout; or-masks take the unsigned ones.
template <class T>
FATHOM_HD T atomic_add(T& x, T value) {
#if defined(__CUDA_ARCH__)
  return static_cast<T>(atomicAdd(detail::cuda_word(x), value));
#elif defined(FATHOM_SYCL_SOURCE)
  return detail::atomic_ref(x).fetch_add(value);
#else
  return std::atomic_ref<T>(x).fetch_add(value, std::memory_order_relaxed);
#endif
}

template <class T>
FATHOM_HD T atomic_min(T& x, T value) {
#if defined(__CUDA_ARCH__)
  return static_cast<T>(atomicMin(detail::cuda_word(x), value));
#elif defined(FATHOM_SYCL_SOURCE)
  return detail::atomic_ref(x).fetch_min(value);
#else
  return detail::atomic_replace_if(x, value, [](T a, T b) { return a < b; });
#endif
}

template <class T>
FATHOM_HD T atomic_max(T& x, T value) {
#if defined(__CUDA_ARCH__)
  return static_cast<T>(atomicMax(detail::cuda_word(x), value));
#elif defined(FATHOM_SYCL_SOURCE)
  return detail::atomic_ref(x).fetch_max(value);
#else
  return detail::atomic_replace_if(x, value, [](T a, T b) { return a > b; });
#endif
}

template <class T>
FATHOM_HD T atomic_or(T& x, T value) {
#if defined(__CUDA_ARCH__)
  return static_cast<T>(atomicOr(detail::cuda_word(x), value));
#elif defined(FATHOM_SYCL_SOURCE)
  return detail::atomic_ref(x).fetch_or(value);
#else
  return std::atomic_ref<T>(x).fetch_or(value, std::memory_order_relaxed);
#endif
}

/// Stores `value`.
template <class T>
FATHOM_HD T atomic_exchange(T& x, T value) {
#if defined(__CUDA_ARCH__)
  return static_cast<T>(atomicExch(detail::cuda_word(x), value));
#elif defined(FATHOM_SYCL_SOURCE)
  return detail::atomic_ref(x).exchange(value);
#else
  return std::atomic_ref<T>(x).exchange(value, std::memory_order_relaxed);
#endif
}

/// Stores `desired` if x equals `expected`; it did so if the returned old value equals `expected`.
template <class T>
FATHOM_HD T atomic_cas(T& x, T expected, T desired) {
#if defined(__CUDA_ARCH__)
  return static_cast<T>(atomicCAS(detail::cuda_word(x), expected, desired));
#elif defined(FATHOM_SYCL_SOURCE)
  detail::atomic_ref(x).compare_exchange_strong(expected, desired);
  return expected;
#else
  std::atomic_ref<T>(x).compare_exchange_strong(expected, desired, std::memory_order_relaxed);
  return expected;
#endif
}

/// Reads a word that other work-items may be writing. On GPUs a volatile access is relaxed; AdaptiveCpp's relaxed loads
/// are plain loads, which may be hoisted out of loops.
template <class T>
FATHOM_HD T atomic_load(const T& x) {
#if defined(__CUDA_ARCH__) || defined(FATHOM_SYCL_SOURCE)
  return *static_cast<const volatile T*>(&x);
#else
  return std::atomic_ref<T>(const_cast<T&>(x)).load(std::memory_order_relaxed);
#endif
}

template <class T>
FATHOM_HD void atomic_store(T& x, T value) {
#if defined(__CUDA_ARCH__) || defined(FATHOM_SYCL_SOURCE)
  *static_cast<volatile T*>(&x) = value;
#else
  std::atomic_ref<T>(x).store(value, std::memory_order_relaxed);
#endif
}

}  // namespace fathom::exec
