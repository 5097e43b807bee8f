// A team: eight work-items of a GPU that run one item of a kernel side by side and share its searches.
//
// All work-items of a team reach every line together and compute the same values, except those in an `Eight`
// (math/eight.hpp), which holds one number per work-item. One of them, the leader, writes. Back ends without teams have
// one work-item per item, which is its own leader.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

namespace fathom::team {

inline constexpr std::uint32_t size = 8;  ///< divides a warp

#if defined(__CUDA_ARCH__)
inline constexpr std::uint32_t items = size;  ///< in a team, on this target
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
/// A bit for each work-item of the team.
FATHOM_HD unsigned ballot(bool vote) {
#if defined(__CUDA_ARCH__)
  return __ballot_sync(warp_mask(), vote) >> (threadIdx.x & (32 - size)) & 0xffu;
#else
  return vote ? 1u : 0u;
#endif
}
/// The value of the work-item whose number differs in these bits; in a team of one, its own.
template <class T>
FATHOM_HD T from_item_xor(T value, [[maybe_unused]] int bits) {
#if defined(__CUDA_ARCH__)
  return __shfl_xor_sync(warp_mask(), value, bits, size);
#else
  return value;
#endif
}
/// The value of the work-item with this number; in a team of one, its own.
template <class T>
FATHOM_HD T from_item(T value, [[maybe_unused]] int item) {
#if defined(__CUDA_ARCH__)
  return __shfl_sync(warp_mask(), value, item, size);
#else
  return value;
#endif
}

/// Number of bits that a ballot has set.
FATHOM_HD std::uint32_t count_of(unsigned votes) {
#if defined(__CUDA_ARCH__)
  return static_cast<std::uint32_t>(__popc(votes));
#else
  return votes;
#endif
}
/// The work-item of the n-th bit that a ballot has set; any if there are not so many.
FATHOM_HD int nth([[maybe_unused]] unsigned votes, [[maybe_unused]] unsigned n) {
#if defined(__CUDA_ARCH__)
  for (; n > 0; --n) votes &= votes - 1;
  return (__ffs(static_cast<int>(votes)) - 1) & static_cast<int>(size - 1);
#else
  return 0;
#endif
}
/// Barrier of the team: its work-items' earlier reads and writes are complete, for all of them.
FATHOM_HD void sync() {
#if defined(__CUDA_ARCH__)
  __syncwarp(warp_mask());
#endif
}

/// Whether `holds` is true for the whole team. Also a barrier: earlier writes are complete for all of them.
FATHOM_HD bool all(bool holds) {
  sync();
#if defined(__CUDA_ARCH__)
  holds = __all_sync(warp_mask(), holds);
#endif
  return holds;
}

/// Whether this work-item leads its team, where kernels run in teams: see `exec::runs_in_teams`.
FATHOM_HD bool is_leader() { return item() == 0; }

}  // namespace fathom::team
