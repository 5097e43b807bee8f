// A work-group on CUDA: a thread block. Sections are described in group.hpp.
#pragma once

#include <cstdint>

namespace fathom::exec {

template <std::uint32_t Size>
class CudaGroup {
 public:
  static constexpr std::uint32_t size = Size;

  /// Each work-item is a thread and keeps its own value in a register.
  template <class T>
  class PerItem {
   public:
    __device__ T& operator[](std::uint32_t) { return value_; }

   private:
    T value_;
  };

  __device__ explicit CudaGroup(std::uint32_t index) : index_(index) {}

  __device__ std::uint32_t index() const { return index_; }

  template <class Section>
  __device__ void for_each(Section section) const {
    section(threadIdx.x);
    __syncthreads();
  }
  template <class Section>
  __device__ void for_each(std::uint32_t n, Section section) const {
    for (std::uint32_t i = threadIdx.x; i < n; i += Size) section(i);
    __syncthreads();
  }
  template <class Section>
  __device__ void once(Section section) const {
    if (threadIdx.x == 0) section();
    __syncthreads();
  }
  template <class T>
  __device__ T broadcast(const T& local) const {
    const T value = local;
    __syncthreads();  // all have read before any may overwrite
    return value;
  }

 private:
  std::uint32_t index_;
};

}  // namespace fathom::exec
