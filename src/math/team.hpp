// A team: eight work-items of a GPU that run one item of a kernel side by side and share its searches.
//
// All of a team come to every line together and compute the same, but for what an `Eight` (collision/eight.hpp) holds,
// which is a number a work-item. One of them, the leader, writes. Back ends without teams have one work-item an item,
// which leads itself.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

namespace fathom::team {

inline constexpr std::uint32_t size = 8;  ///< divides a warp

#if defined(__CUDA_ARCH__)
/// This work-item's number in its team.
__device__ inline int lane() { return static_cast<int>(threadIdx.x % size); }
/// The team's work-items among those of the warp.
__device__ inline unsigned warp_mask() { return 0xffu << (threadIdx.x & (32 - size)); }
/// A bit for each of the team.
__device__ inline unsigned ballot(bool vote) {
  return __ballot_sync(warp_mask(), vote) >> (threadIdx.x & (32 - size)) & 0xffu;
}
template <class T>
__device__ inline T from_lane_xor(T value, int bits) {
  return __shfl_xor_sync(warp_mask(), value, bits, size);
}
template <class T>
__device__ inline T from_lane(T value, int lane) {
  return __shfl_sync(warp_mask(), value, lane, size);
}
#endif

/// What its work-items wrote and read before is done, for all of the team.
FATHOM_HD void sync() {
#if defined(__CUDA_ARCH__)
  __syncwarp(warp_mask());
#endif
}

#if defined(__CUDA_ARCH__)
inline constexpr std::uint32_t items = size;  ///< of a team, here
#else
inline constexpr std::uint32_t items = 1;
#endif
/// This one's number among them.
FATHOM_HD std::uint32_t item() {
#if defined(__CUDA_ARCH__)
  return threadIdx.x % size;
#else
  return 0;
#endif
}
/// Whether `holds` is true for all of the team. What they wrote before is done, for all of them.
FATHOM_HD bool all(bool holds) {
  sync();
#if defined(__CUDA_ARCH__)
  holds = __all_sync(warp_mask(), holds);
#endif
  return holds;
}

/// Of the work-items of a team, where kernels run in teams: see `exec::runs_in_teams`.
FATHOM_HD bool is_leader() {
#if defined(__CUDA_ARCH__)
  return lane() == 0;
#else
  return true;
#endif
}

}  // namespace fathom::team
