// The CUDA kernels that run the three shapes of kernel structs.
#pragma once

#include <cooperative_groups.h>

#include <cstdint>

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

/// One cooperative launch: every block is resident, so all can wait for each other.
template <class Kernel>
__global__ __launch_bounds__(items_per_group<Kernel>()) void run_phases(std::uint32_t most_phases,
                                                                        std::uint32_t most_items,
                                                                        const __grid_constant__ Kernel kernel) {
  const cooperative_groups::grid_group grid = cooperative_groups::this_grid();
  const std::uint32_t stride = gridDim.x * blockDim.x;
  for (std::uint32_t phase = 0; phase < most_phases && phase < kernel.phases(); ++phase) {
    const std::uint32_t items = kernel.items(phase);
    if (ends_at_empty_phase<Kernel>() && items == 0) return;
    const std::uint32_t n = items < most_items ? items : most_items;
    for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < n; i += stride) kernel(phase, i);
    grid.sync();
  }
}

}  // namespace fathom::exec::cuda
