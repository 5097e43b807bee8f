// Eight numbers side by side: vertices or planes of a hull in a register of the widest kind that the floor has.
//
// GCC and Clang map the vector types to what instructions there are, two of four on Arm. Every operation rounds as the
// one of single numbers does, so what is found with them has the same bits as what a GPU finds one by one.
#pragma once

#include <fathom/shape.hpp>

#if !defined(__CUDACC__) && !defined(FATHOM_SYCL_SOURCE)
#define FATHOM_HAS_EIGHT 1
#endif

#if defined(FATHOM_HAS_EIGHT)

#include <bit>

#if defined(__FMA__)
#include <immintrin.h>
#endif

namespace fathom {

typedef float Eight __attribute__((vector_size(32)));  // a vector type cannot be named by `using` in GCC 12
typedef std::int32_t EightInts __attribute__((vector_size(32)));

inline Eight eight(float x) { return Eight{x, x, x, x, x, x, x, x}; }
inline EightInts eight(std::int32_t x) { return EightInts{x, x, x, x, x, x, x, x}; }
inline const Eight& eight(const float* aligned) { return *reinterpret_cast<const Eight*>(aligned); }

/// a·b + c with one rounding.
inline Eight fma(Eight a, Eight b, Eight c) {
#if defined(__FMA__)
  return (Eight)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c);
#else
  for (int i = 0; i < 8; ++i) c[i] = fathom::fma(a[i], b[i], c[i]);
  return c;
#endif
}
inline Eight min(Eight a, Eight b) { return a < b ? a : b; }
inline EightInts min(EightInts a, EightInts b) { return a < b ? a : b; }

/// A bit for each lane that is true.
inline unsigned bits(EightInts mask) {
#if defined(__FMA__)
  return static_cast<unsigned>(_mm256_movemask_ps((__m256)mask));
#else
  unsigned result = 0;
  for (int i = 0; i < 8; ++i) result |= (mask[i] != 0 ? 1u : 0u) << i;
  return result;
#endif
}

/// Three coordinates of eight vectors.
struct EightVec3 {
  Eight x, y, z;
};
inline EightVec3 eight(Vec3 v) { return {eight(v.x), eight(v.y), eight(v.z)}; }
/// As fathom::dot.
inline Eight dot(const EightVec3& a, const EightVec3& b) { return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x)); }
inline EightVec3 vectors(const Hull::Eight& block) { return {eight(block.x), eight(block.y), eight(block.z)}; }

/// The least of the lanes, of equals the one with the lowest index; index 0 where nothing is a number.
struct LeastLane {
  float value;
  int index;
};
inline LeastLane least_lane(Eight values, EightInts indices) {
  Eight least = min(values, __builtin_shufflevector(values, values, 4, 5, 6, 7, 0, 1, 2, 3));
  least = min(least, __builtin_shufflevector(least, least, 2, 3, 0, 1, 6, 7, 4, 5));
  least = min(least, __builtin_shufflevector(least, least, 1, 0, 3, 2, 5, 4, 7, 6));
  EightInts index = values == least ? indices : eight(0x7fffffff);
  index = min(index, __builtin_shufflevector(index, index, 4, 5, 6, 7, 0, 1, 2, 3));
  index = min(index, __builtin_shufflevector(index, index, 2, 3, 0, 1, 6, 7, 4, 5));
  index = min(index, __builtin_shufflevector(index, index, 1, 0, 3, 2, 5, 4, 7, 6));
  return {least[0], index[0] == 0x7fffffff ? 0 : index[0]};
}

}  // namespace fathom

#endif
