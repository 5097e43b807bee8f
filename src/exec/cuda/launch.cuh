// The CUDA kernels that run the three shapes of kernel structs.
#pragma once

#include <cstdint>

#include "exec/cuda/cuda_group.cuh"
#include "exec/kernel.hpp"
#include "exec/phases.hpp"
#include "exec/range.hpp"

namespace fathom::exec::cuda {

template <class Kernel>
__global__ __launch_bounds__(items_per_group<Kernel>()) void run_items(const __grid_constant__ Range range,
                                                                       const __grid_constant__ Kernel kernel) {
  const std::uint32_t n = range.size();
  const std::uint32_t stride = gridDim.x * blockDim.x;
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < n; i += stride) kernel(i);
}

template <class Kernel>
__global__ __launch_bounds__(Kernel::group_size) void run_groups(const __grid_constant__ Range groups,
                                                                 const __grid_constant__ Kernel kernel) {
  __shared__ typename Kernel::Local local;
  const std::uint32_t n = groups.size();
  // Every section ends with a barrier, so the next group may reuse the local memory.
  for (std::uint32_t i = blockIdx.x; i < n; i += gridDim.x) kernel(CudaGroup<Kernel::group_size>(i), local);
}

/// Blocks of the largest cluster that a kernel may ask for.
inline constexpr std::uint32_t most_cluster_blocks = 16;

/// A barrier of all resident blocks. Together they add 2³¹ to the word, so its highest bit turns when the last one has
/// arrived and the others are as they were: nothing is ever reset, and nobody waits for the answer to an addition,
/// which cooperative_groups does. The word starts as 0, and belongs to one launch at a time.
class GridBarrier {
 public:
  __device__ explicit GridBarrier(std::uint32_t* word) : word_(word), turned_(~load() & turning_bit) {}

  __device__ void wait_for_all() {
    __syncthreads();
    if (threadIdx.x == 0) {
      const std::uint32_t share = blockIdx.x == 0 ? turning_bit - (gridDim.x - 1) : 1;
      asm volatile("red.release.gpu.global.add.u32 [%0], %1;" ::"l"(word_), "r"(share) : "memory");
    }
    if (threadIdx.x == 0)
      while ((load() & turning_bit) != turned_) {
      }
    turned_ ^= turning_bit;
    __syncthreads();
  }

 private:
  static constexpr std::uint32_t turning_bit = 0x8000'0000u;

  __device__ std::uint32_t load() const {
    std::uint32_t value;
    asm volatile("ld.acquire.gpu.global.u32 %0, [%1];" : "=r"(value) : "l"(word_) : "memory");
    return value;
  }

  std::uint32_t* word_;
  std::uint32_t turned_;  ///< the bit when all have arrived
};

/// The barrier of a thread block cluster, which is in hardware.
class ClusterBarrier {
 public:
  __device__ explicit ClusterBarrier(std::uint32_t*) {}

  __device__ void wait_for_all() {
#if __CUDA_ARCH__ >= 900
    // One thread's fence makes the whole block's writes visible, as in a grid's barrier: the one that the cluster's
    // barrier comes with would be every thread's.
    __syncthreads();
    if (threadIdx.x == 0) asm volatile("fence.acq_rel.cluster;" ::: "memory");
    asm volatile("barrier.cluster.arrive.relaxed.aligned;" ::: "memory");
    asm volatile("barrier.cluster.wait.acquire.aligned;" ::: "memory");
#endif
  }
};

/// All phases, once the plan is made.
template <class Barrier, class Kernel, std::uint32_t Size, bool ends_at_empty>
__global__ __launch_bounds__(Size) void run_phases(std::uint32_t most_phases, std::uint32_t most_items,
                                                   std::uint32_t* barrier_word, const __grid_constant__ Kernel kernel) {
  __shared__ typename Kernel::Plan plan;
  if constexpr (Kernel::plan_parts > 0) {
    for (std::uint32_t k = threadIdx.x; k < Kernel::plan_parts; k += blockDim.x) kernel.plan_part(plan, k);
    __syncthreads();
  }
  Barrier barrier(barrier_word);
  // Warps take turns between the blocks: a phase of few items then has as many multiprocessors to itself as it has
  // warps.
  constexpr std::uint32_t warp_size = 32;
  const std::uint32_t first = (threadIdx.x / warp_size * gridDim.x + blockIdx.x) * warp_size + threadIdx.x % warp_size;
  run_planned<ends_at_empty>(first, gridDim.x * blockDim.x, most_phases, most_items, kernel, plan,
                             [&] { barrier.wait_for_all(); });
}

}  // namespace fathom::exec::cuda
