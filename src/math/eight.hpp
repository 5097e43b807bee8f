// Eight numbers side by side: in a register of the widest kind in the minimum instruction set, or one per work-item of
// a team (math/team.hpp).
//
// GCC and Clang map the vector types to the available instructions, two of four lanes each on Arm. Every operation
// rounds like its scalar counterpart, so results with eight have the same bits as results one by one.
#pragma once

#include <fathom/math.hpp>

#if !defined(FATHOM_SYCL_SOURCE)
#define FATHOM_HAS_EIGHT 1
#endif

#if defined(FATHOM_HAS_EIGHT)

#include <bit>

#if defined(__CUDACC__)
#include "math/team.hpp"
#elif defined(__FMA__)
#include <immintrin.h>
#endif

namespace fathom {

#if defined(__CUDACC__)

/// This work-item's number of the eight.
struct Eight {
  float lane;
};
/// An integer, or a mask: all bits or none.
struct EightInts {
  std::int32_t lane;
};

FATHOM_HD Eight eight(float x) { return {x}; }
FATHOM_HD EightInts eight(std::int32_t x) { return {x}; }
FATHOM_HD Eight operator-(Eight a) { return {-a.lane}; }
FATHOM_HD Eight operator-(Eight a, Eight b) { return {a.lane - b.lane}; }
FATHOM_HD Eight operator*(Eight a, Eight b) { return {a.lane * b.lane}; }
FATHOM_HD EightInts operator<(Eight a, Eight b) { return {a.lane < b.lane ? -1 : 0}; }
FATHOM_HD EightInts operator<(EightInts a, EightInts b) { return {a.lane < b.lane ? -1 : 0}; }
FATHOM_HD EightInts operator>(Eight a, Eight b) { return {a.lane > b.lane ? -1 : 0}; }
FATHOM_HD EightInts operator&(EightInts a, EightInts b) { return {a.lane & b.lane}; }
FATHOM_HD EightInts operator+(EightInts a, std::int32_t b) { return {a.lane + b}; }
FATHOM_HD Eight fma(Eight a, Eight b, Eight c) { return {fathom::fma(a.lane, b.lane, c.lane)}; }
FATHOM_HD Eight min(Eight a, Eight b) { return {a.lane < b.lane ? a.lane : b.lane}; }
FATHOM_HD Eight select(EightInts mask, Eight a, Eight b) { return mask.lane != 0 ? a : b; }
FATHOM_HD EightInts select(EightInts mask, EightInts a, EightInts b) { return mask.lane != 0 ? a : b; }

// The following functions communicate with the other work-items. The host calls none of them, though nvcc compiles them
// for it, too.

/// 0, 1, …, 7.
FATHOM_HD EightInts lane_numbers() { return {static_cast<std::int32_t>(team::item())}; }
/// A bit for each lane that is true.
FATHOM_HD unsigned bits(EightInts mask) { return team::ballot(mask.lane != 0); }

/// Blocks of eight in an array of floats, which is distributed over the team's work-items: each stores its own lane.
FATHOM_HD Eight& eight_at(float* numbers, int first) { return reinterpret_cast<Eight&>(numbers[first / 8]); }
FATHOM_HD void set_number(float* numbers, int i, float value) {
  if (i % 8 == lane_numbers().lane) numbers[i / 8] = value;
}

#else

typedef float Eight __attribute__((vector_size(32)));  // a vector type cannot be named by `using` in GCC 12
typedef std::int32_t EightInts __attribute__((vector_size(32)));

#include "math/eight-inl.hpp"

/// The eight numbers from `first` on, a multiple of eight.
inline Eight& eight_at(float* numbers, int first) { return reinterpret_cast<Eight&>(numbers[first]); }
inline void set_number(float* numbers, int i, float value) { numbers[i] = value; }

#endif

/// The lowest bit that is set. nvcc compiles std::countr_zero, but in kernels it returns 32 for any word.
FATHOM_HD int lowest_bit(unsigned word) {
#if defined(__CUDACC__)
  return std::popcount((word & (0u - word)) - 1);
#else
  return std::countr_zero(word);
#endif
}

/// Coordinates of eight vectors.
struct EightVec3 {
  Eight x, y, z;
};
FATHOM_HD EightVec3 eight(Vec3 v) { return {eight(v.x), eight(v.y), eight(v.z)}; }
/// Rounds like fathom::dot.
FATHOM_HD Eight dot(const EightVec3& a, const EightVec3& b) { return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x)); }

struct EightPlanes {
  EightVec3 normals;
  Eight offsets;
};
FATHOM_HD Eight plane_height(const EightPlanes& planes, const EightVec3& point) {
  return dot(planes.normals, point) - planes.offsets;
}

/// The least lane; among equals the one with the lowest index; index 0 if all are NaN.
struct LeastLane {
  float value;
  int index;
};
#if defined(__CUDACC__)
FATHOM_HD LeastLane min_lane(Eight values, EightInts indices) {
  float least = values.lane;
  for (int bits = 4; bits > 0; bits /= 2) {
    const float other = team::from_item_xor(least, bits);
    least = least < other ? least : other;
  }
  int index = values.lane == least ? indices.lane : 0x7fffffff;
  for (int bits = 4; bits > 0; bits /= 2) {
    const int other = team::from_item_xor(index, bits);
    index = index < other ? index : other;
  }
  index = team::from_item(index, 0);
  return {team::from_item(least, 0), index == 0x7fffffff ? 0 : index};
}
#else
inline LeastLane min_lane(Eight values, EightInts indices) {
  Eight least = min(values, __builtin_shufflevector(values, values, 4, 5, 6, 7, 0, 1, 2, 3));
  least = min(least, __builtin_shufflevector(least, least, 2, 3, 0, 1, 6, 7, 4, 5));
  least = min(least, __builtin_shufflevector(least, least, 1, 0, 3, 2, 5, 4, 7, 6));
  EightInts index = values == least ? indices : eight(0x7fffffff);
  index = min(index, __builtin_shufflevector(index, index, 4, 5, 6, 7, 0, 1, 2, 3));
  index = min(index, __builtin_shufflevector(index, index, 2, 3, 0, 1, 6, 7, 4, 5));
  index = min(index, __builtin_shufflevector(index, index, 1, 0, 3, 2, 5, 4, 7, 6));
  return {least[0], index[0] == 0x7fffffff ? 0 : index[0]};
}
#endif

}  // namespace fathom

#endif
