// A team: eight work-items of a GPU that run one item of a kernel side by side and share its searches.
//
// All of a team come to every line together and compute the same, but for what an `Eight` (math/eight.hpp) holds,
// which is a number a work-item. One of them, the leader, writes. Back ends without teams have one work-item an item,
// which leads itself.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

namespace fathom::team {

inline constexpr std::uint32_t size = 8;  ///< divides a warp

#if defined(__CUDA_ARCH__)
inline constexpr std::uint32_t items = size;  ///< of a team, here
/// The team's work-items among those of the warp.
__device__ inline unsigned warp_mask() { return 0xffu << (threadIdx.x & (32 - size)); }
#else
inline constexpr std::uint32_t items = 1;
#endif

/// This work-item's number in its team.
FATHOM_HD std::uint32_t item() {
#if defined(__CUDA_ARCH__)
  return threadIdx.x % size;
#else
  return 0;
#endif
}
/// A bit for each of the team.
FATHOM_HD unsigned ballot(bool vote) {
#if defined(__CUDA_ARCH__)
  return __ballot_sync(warp_mask(), vote) >> (threadIdx.x & (32 - size)) & 0xffu;
#else
  return vote ? 1u : 0u;
#endif
}
/// The value of the work-item whose number differs in these bits; where a team is one, its own.
template <class T>
FATHOM_HD T from_item_xor(T value, [[maybe_unused]] int bits) {
#if defined(__CUDA_ARCH__)
  return __shfl_xor_sync(warp_mask(), value, bits, size);
#else
  return value;
#endif
}
/// The value of the work-item of this number; where a team is one, its own.
template <class T>
FATHOM_HD T from_item(T value, [[maybe_unused]] int item) {
#if defined(__CUDA_ARCH__)
  return __shfl_sync(warp_mask(), value, item, size);
#else
  return value;
#endif
}

/// What its work-items wrote and read before is done, for all of the team.
FATHOM_HD void sync() {
#if defined(__CUDA_ARCH__)
  __syncwarp(warp_mask());
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
FATHOM_HD bool is_leader() { return item() == 0; }

}  // namespace fathom::team
