// The CUDA kernels that run the three shapes of kernel structs.
#pragma once

#include <cstdint>

#include "exec/cuda/cuda_group.cuh"
#include "exec/kernel.hpp"
#include "exec/phases.hpp"
#include "exec/range.hpp"
#include "math/team.hpp"

namespace fathom::exec::cuda {

inline constexpr std::uint32_t warp_size = 32;

/// Allows the next kernel of the queue to be set up while this one runs, and waits until the previous one has ended and
/// its writes are visible ("programmatic dependent launch").
__device__ inline void follow() {
#if __CUDA_ARCH__ >= 900
  asm volatile("griddepcontrol.launch_dependents;" ::: "memory");
  asm volatile("griddepcontrol.wait;" ::: "memory");
#endif
}

/// Number of work-items per item.
template <class Kernel>
constexpr std::uint32_t work_items_each() {
  return runs_in_teams<Kernel>() ? team::size : 1;
}

template <class Kernel>
__global__ __launch_bounds__(items_per_group<Kernel>()) void run_items(const __grid_constant__ Range range,
                                                                       const __grid_constant__ Kernel kernel) {
  follow();
  const std::uint32_t n = range.size();
  constexpr std::uint32_t team = work_items_each<Kernel>();
  const std::uint32_t stride = gridDim.x * blockDim.x / team;
  for (std::uint32_t i = (blockIdx.x * blockDim.x + threadIdx.x) / team; i < n; i += stride) kernel(i);
}

template <class Kernel>
__global__ __launch_bounds__(Kernel::group_size) void run_groups(const __grid_constant__ Range groups,
                                                                 const __grid_constant__ Kernel kernel) {
  __shared__ typename Kernel::Local local;
  follow();
  const std::uint32_t n = groups.size();
  // Every section ends with a barrier, so the next group may reuse the local memory.
  for (std::uint32_t i = blockIdx.x; i < n; i += gridDim.x) kernel(CudaGroup<Kernel::group_size>(i), local);
}

/// Maximum blocks of a cluster.
inline constexpr std::uint32_t max_cluster_blocks = 16;

/// Named barriers of a block: 0 is that of __syncthreads.
enum BlockBarrier : std::uint32_t { all_arrived = 1, all_may_go = 2 };

__device__ inline void arrive_at(BlockBarrier barrier) {
  asm volatile("barrier.cta.arrive.aligned %0, %1;" ::"r"(static_cast<std::uint32_t>(barrier)), "r"(blockDim.x)
               : "memory");
}
__device__ inline void wait_at(BlockBarrier barrier) {
  asm volatile("barrier.cta.sync.aligned %0, %1;" ::"r"(static_cast<std::uint32_t>(barrier)), "r"(blockDim.x)
               : "memory");
}

/// A barrier of all resident blocks. Together they add 2³¹ to the word, so its highest bit flips when the last one has
/// arrived and the others are unchanged: nothing needs a reset, and no block waits for the result of an addition,
/// unlike in cooperative_groups. The word starts at 0 and belongs to one launch at a time.
///
/// With a barrier warp, a block's last warp only signals the others' arrival and waits for all blocks, while the others
/// load.
template <bool has_barrier_warp>
class GridBarrier {
 public:
  static constexpr bool with_barrier_warp = has_barrier_warp;
  __device__ GridBarrier(std::uint32_t* word, bool is_barrier_warp)
      : word_(word), turned_(~load() & turning_bit), is_barrier_warp_(is_barrier_warp) {}

  __device__ void arrive() {
    if constexpr (has_barrier_warp) {
      __syncwarp();
      if (is_barrier_warp_) {
        wait_at(all_arrived);
        if (threadIdx.x % warp_size == 0) tell();
      } else {
        arrive_at(all_arrived);
      }
    }
  }

  __device__ void wait() {
    if constexpr (has_barrier_warp) {
      if (is_barrier_warp_) {
        if (threadIdx.x % warp_size == 0) listen();
        turned_ ^= turning_bit;
        __syncwarp();
      }
      wait_at(all_may_go);
    } else {
      __syncthreads();
      if (threadIdx.x == 0) {
        tell();
        listen();
      }
      turned_ ^= turning_bit;
      __syncthreads();
    }
  }

  __device__ void pass() const { __syncwarp(); }
  __device__ void wait_for_warp() const { __syncwarp(); }

 private:
  static constexpr std::uint32_t turning_bit = 0x8000'0000u;

  __device__ void tell() const {
    const std::uint32_t share = blockIdx.x == 0 ? turning_bit - (gridDim.x - 1) : 1;
    asm volatile("red.release.gpu.global.add.u32 [%0], %1;" ::"l"(word_), "r"(share) : "memory");
  }
  __device__ void listen() const {
    while ((load() & turning_bit) != turned_) {
    }
  }
  __device__ std::uint32_t load() const {
    std::uint32_t value;
    asm volatile("ld.acquire.gpu.global.u32 %0, [%1];" : "=r"(value) : "l"(word_) : "memory");
    return value;
  }

  std::uint32_t* word_;
  std::uint32_t turned_;  ///< value of the bit once all have arrived
  bool is_barrier_warp_;
};

/// The hardware barrier of a thread block cluster.
class ClusterBarrier {
 public:
  static constexpr bool with_barrier_warp = true;
  __device__ ClusterBarrier(std::uint32_t*, bool is_barrier_warp) : is_barrier_warp_(is_barrier_warp) {}

  // A fence by one thread makes the whole block's writes visible, as in the grid's barrier; the cluster barrier's own
  // fence would be executed by every thread. The barrier warp executes it, while the others load.
  __device__ void arrive() {
#if __CUDA_ARCH__ >= 900
    __syncwarp();
    if (is_barrier_warp_) {
      wait_at(all_arrived);
      if (threadIdx.x % warp_size == 0) asm volatile("fence.acq_rel.cluster;" ::: "memory");
      __syncwarp();
    } else {
      arrive_at(all_arrived);
    }
    asm volatile("barrier.cluster.arrive.relaxed.aligned;" ::: "memory");
#endif
  }

  __device__ void wait() {
#if __CUDA_ARCH__ >= 900
    asm volatile("barrier.cluster.wait.acquire.aligned;" ::: "memory");
#endif
  }

  __device__ void pass() const { __syncwarp(); }
  __device__ void wait_for_warp() const { __syncwarp(); }

 private:
  bool is_barrier_warp_;
};

/// Makes the plan, then runs all phases.
template <class Barrier, class Kernel, std::uint32_t Size, bool ends_at_empty>
__global__ __launch_bounds__(Size + (Barrier::with_barrier_warp ? warp_size : 0),
                             Barrier::with_barrier_warp || wants_registers<Kernel>()
                                 ? 1
                                 : 2) void run_phases(std::uint32_t max_phases, std::uint32_t max_phase_items,
                                                      std::uint32_t* barrier_word,
                                                      const __grid_constant__ Kernel kernel) {
  follow();
  __shared__ typename Kernel::Plan plan;
  if constexpr (Kernel::plan_parts > 0) {
    for (std::uint32_t k = threadIdx.x; k < Kernel::plan_parts; k += blockDim.x) kernel.plan_part(plan, k);
    if constexpr (!Barrier::with_barrier_warp && requires { kernel.keep_barriers(plan); })
      if (threadIdx.x == 0) kernel.keep_barriers(plan);
    __syncthreads();
  }
  const bool is_barrier_warp = threadIdx.x >= Size;
  if constexpr (requires { kernel.needs_barriers(plan); })
    if (is_barrier_warp && !kernel.needs_barriers(plan)) return;
  Barrier barrier(barrier_word, is_barrier_warp);
  // Warps are interleaved over the blocks: a phase of few items then uses as many multiprocessors as it has warps.
  const std::uint32_t first = (threadIdx.x / warp_size * gridDim.x + blockIdx.x) * warp_size + threadIdx.x % warp_size;
  run_planned<ends_at_empty>(is_barrier_warp ? ~0u : first, gridDim.x * Size, max_phases, max_phase_items, kernel, plan,
                             barrier);
}

}  // namespace fathom::exec::cuda
