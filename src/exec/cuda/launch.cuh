// The CUDA kernels that run the three shapes of kernel structs.
#pragma once

#include <cooperative_groups.h>

#include <cstdint>
#include <utility>

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

/// How all work-items of a launch wait for each other.
enum class Barrier {
  block,    ///< there is only one block, which keeps what items share in its local memory
  cluster,  ///< one thread block cluster, whose barrier is in hardware (compute capability 9.0)
  grid,     ///< a cooperative launch: every block is resident
};

/// Threads of the one block of `Barrier::block`: few enough to leave each many registers.
inline constexpr std::uint32_t resident_block_size = 384;

/// Blocks of the largest cluster that a kernel may ask for.
inline constexpr std::uint32_t most_cluster_blocks = 16;

/// Runs `meanwhile` between arriving at the barrier and leaving it.
template <Barrier barrier, class Meanwhile>
__device__ void wait_for_all(const Meanwhile& meanwhile) {
  if constexpr (barrier == Barrier::block) {
    meanwhile();
    __syncthreads();
  } else if constexpr (barrier == Barrier::cluster) {
#if __CUDA_ARCH__ >= 900
    // One thread's fence makes the whole block's writes visible, as in a grid's barrier: the one that the cluster's
    // barrier comes with would be every thread's.
    __syncthreads();
    if (threadIdx.x == 0) __threadfence();
    asm volatile("barrier.cluster.arrive.relaxed.aligned;" ::: "memory");
    meanwhile();
    asm volatile("barrier.cluster.wait.acquire.aligned;" ::: "memory");
#endif
  } else {
    const cooperative_groups::grid_group grid = cooperative_groups::this_grid();
    auto token = grid.barrier_arrive();
    meanwhile();
    grid.barrier_wait(std::move(token));
  }
}

/// All phases, once the plan is made.
template <Barrier barrier, bool ends_at_empty, class Kernel>
__device__ void run_with_barrier(std::uint32_t most_phases, std::uint32_t most_items, const Kernel& kernel,
                                 const typename Kernel::Plan& plan) {
  // Warps take turns between the blocks: a phase of few items then has as many multiprocessors to itself as it has warps.
  constexpr std::uint32_t warp_size = 32;
  const std::uint32_t first =
      (threadIdx.x / warp_size * gridDim.x + blockIdx.x) * warp_size + threadIdx.x % warp_size;
  run_planned<ends_at_empty>(first, gridDim.x * blockDim.x, most_phases, most_items, kernel, plan,
                             [](const auto& meanwhile) { wait_for_all<barrier>(meanwhile); });
}

template <Barrier barrier, class Kernel, std::uint32_t Size, bool ends_at_empty>
__global__ __launch_bounds__(Size) void run_phases(std::uint32_t most_phases, std::uint32_t most_items,
                                                   const __grid_constant__ Kernel kernel) {
  __shared__ typename Kernel::Plan plan;
  if constexpr (Kernel::plan_parts > 0) {
    for (std::uint32_t k = threadIdx.x; k < Kernel::plan_parts; k += blockDim.x) kernel.plan_part(plan, k);
    __syncthreads();
  }
  if constexpr (barrier == Barrier::block) {
    extern __shared__ float4 resident_memory[];
    std::byte* const local = reinterpret_cast<std::byte*>(resident_memory);
    if (kernel.phases(plan) == 0) return;
    const std::uint32_t n = kernel.resident_items(plan);
    for (std::uint32_t i = threadIdx.x; i < n; i += blockDim.x) kernel.load_resident(local, i);
    __syncthreads();
    run_with_barrier<barrier, ends_at_empty>(most_phases, most_items, kernel.resident(local), plan);
    __syncthreads();
    for (std::uint32_t i = threadIdx.x; i < n; i += blockDim.x) kernel.store_resident(local, i);
  } else {
    run_with_barrier<barrier, ends_at_empty>(most_phases, most_items, kernel, plan);
  }
}

}  // namespace fathom::exec::cuda
