// The CUDA kernels that run the three shapes of kernel structs.
#pragma once

#include <cooperative_groups.h>

#include <cstdint>
#include <utility>

#include "exec/cuda/cuda_group.cuh"
#include "exec/kernel.hpp"
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

/// How all blocks of a launch wait for each other.
enum class Barrier {
  grid,     ///< a cooperative launch: every block is resident
  cluster,  ///< one thread block cluster, whose barrier is in hardware (compute capability 9.0)
};

/// Blocks of the largest cluster that a kernel may ask for.
inline constexpr std::uint32_t most_cluster_blocks = 16;

template <Barrier barrier, class Kernel, std::uint32_t Size, bool ends_at_empty>
__global__ __launch_bounds__(Size) void run_phases(std::uint32_t most_phases, std::uint32_t most_items,
                                                   const __grid_constant__ Kernel kernel) {
  __shared__ typename Kernel::Plan plan;
  if constexpr (Kernel::plan_parts > 0) {
    for (std::uint32_t k = threadIdx.x; k < Kernel::plan_parts; k += blockDim.x) kernel.plan_part(plan, k);
    __syncthreads();
  }
  const std::uint32_t stride = gridDim.x * blockDim.x, first = blockIdx.x * blockDim.x + threadIdx.x;
  const std::uint32_t planned_phases = kernel.phases(plan);
  const std::uint32_t phases = planned_phases < most_phases ? planned_phases : most_phases;
  const auto items_of = [&](const typename Kernel::Place& place) {
    const std::uint32_t items = kernel.items(plan, place);
    return items < most_items ? items : most_items;
  };
  if (phases == 0) return;
  auto place = kernel.place(plan, 0);
  std::uint32_t n = items_of(place);
  typename Kernel::Fetched fetched;
  if (first < n) fetched = kernel.fetch(plan, place, first);
  for (std::uint32_t phase = 0;; ++phase) {
    if (ends_at_empty && n == 0) return;
    if (first < n) kernel(plan, place, first, fetched);
    for (std::uint32_t i = first + stride; i < n; i += stride) kernel(plan, place, i, kernel.fetch(plan, place, i));
    if (phase + 1 == phases) return;
    // Between arriving at the barrier and leaving it there is time for the loads of the next phase.
    const auto fetch_next = [&] {
      place = kernel.place(plan, phase + 1);
      if constexpr (Kernel::plan_parts > 0) {
        n = items_of(place);
        if (first < n) fetched = kernel.fetch(plan, place, first);
      }
    };
    if constexpr (barrier == Barrier::grid) {
      const cooperative_groups::grid_group grid = cooperative_groups::this_grid();
      auto token = grid.barrier_arrive();
      fetch_next();
      grid.barrier_wait(std::move(token));
    } else {
#if __CUDA_ARCH__ >= 900
      const cooperative_groups::cluster_group cluster = cooperative_groups::this_cluster();
      auto token = cluster.barrier_arrive();
      fetch_next();
      cluster.barrier_wait(std::move(token));
#endif
    }
    // How many items a phase without a plan has may be what the phase before has counted.
    if constexpr (Kernel::plan_parts == 0) n = items_of(place);
  }
}

}  // namespace fathom::exec::cuda
