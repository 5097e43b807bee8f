// Three numbers in a four-lane register: the axes of a box.
//
// GCC and Clang map the vector type to SIMD instructions; for GPUs it is a plain array with the same roundings. Neither
// uses fused operations, so both give the same bits. The fourth lane is zero on entry and never read.
//
// SYCL needs the array, too: LLVM 19 reads a lane with a variable index from a vector on an NVIDIA GPU's stack by a
// generic load with a local address (its NVPTX back end takes the address space from a pointer that such loads lack).
#pragma once

#include <fathom/math.hpp>

namespace fathom {

#if defined(__CUDACC__) || defined(FATHOM_SYCL_SOURCE)

struct alignas(16) Lanes {
  float v[4];
  FATHOM_HD float operator[](int i) const { return v[i]; }
};
FATHOM_HD Lanes operator+(Lanes a, Lanes b) { return {a.v[0] + b.v[0], a.v[1] + b.v[1], a.v[2] + b.v[2], 0}; }
FATHOM_HD Lanes operator-(Lanes a, Lanes b) { return {a.v[0] - b.v[0], a.v[1] - b.v[1], a.v[2] - b.v[2], 0}; }
FATHOM_HD Lanes operator*(Lanes a, Lanes b) { return {a.v[0] * b.v[0], a.v[1] * b.v[1], a.v[2] * b.v[2], 0}; }
FATHOM_HD Lanes operator*(float s, Lanes a) { return {s * a.v[0], s * a.v[1], s * a.v[2], 0}; }
FATHOM_HD Lanes abs(Lanes a) { return {abs(a.v[0]), abs(a.v[1]), abs(a.v[2]), 0}; }
FATHOM_HD Lanes max(Lanes a, Lanes b) { return {max(a.v[0], b.v[0]), max(a.v[1], b.v[1]), max(a.v[2], b.v[2]), 0}; }
FATHOM_HD Lanes min(Lanes a, Lanes b) { return {min(a.v[0], b.v[0]), min(a.v[1], b.v[1]), min(a.v[2], b.v[2]), 0}; }
FATHOM_HD Lanes yzx(Lanes a) { return {a.v[1], a.v[2], a.v[0], 0}; }
FATHOM_HD Lanes zxy(Lanes a) { return {a.v[2], a.v[0], a.v[1], 0}; }

#else

typedef float Lanes __attribute__((vector_size(16)));  // a vector type cannot be named by `using` in GCC 12

using LaneBits = decltype(Lanes{} < Lanes{});
FATHOM_HD Lanes abs(Lanes a) {
  const LaneBits magnitude = {0x7fffffff, 0x7fffffff, 0x7fffffff, 0x7fffffff};
  return (Lanes)((LaneBits)a & magnitude);
}
FATHOM_HD Lanes max(Lanes a, Lanes b) { return a > b ? a : b; }
FATHOM_HD Lanes min(Lanes a, Lanes b) { return a < b ? a : b; }
FATHOM_HD Lanes yzx(Lanes a) { return __builtin_shufflevector(a, a, 1, 2, 0, 3); }
FATHOM_HD Lanes zxy(Lanes a) { return __builtin_shufflevector(a, a, 2, 0, 1, 3); }

#endif

FATHOM_HD Lanes lanes(float x, float y, float z) { return Lanes{x, y, z, 0}; }
FATHOM_HD Lanes lanes(Vec3 a) { return Lanes{a.x, a.y, a.z, 0}; }
FATHOM_HD Vec3 vector(Lanes a) { return {a[0], a[1], a[2]}; }
FATHOM_HD float max_lane(Lanes a) { return max(max(a[0], a[1]), a[2]); }
FATHOM_HD float min_lane(Lanes a) { return min(min(a[0], a[1]), a[2]); }
/// Index of the largest lane; the first of equals.
FATHOM_HD int largest(Lanes a) { return a[0] >= a[1] ? (a[0] >= a[2] ? 0 : 2) : (a[1] >= a[2] ? 1 : 2); }

}  // namespace fathom
