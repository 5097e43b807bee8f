#include <bit>
#include <string>

#include "exec/backends.hpp"
#include "exec/cuda/cuda_device.cuh"

namespace fathom::exec {

namespace {

DeviceInfo describe(int index) {
  DeviceInfo info;
  info.backend = Backend::cuda;
  info.index = index;
  info.is_gpu = true;
  cudaDeviceProp properties;
  cudaError_t result = cudaGetDeviceProperties(&properties, index);
  if (result == cudaSuccess) {
    info.name = properties.name;
    info.memory = properties.totalGlobalMem;
    info.compute_units = static_cast<std::uint32_t>(properties.multiProcessorCount);
    result = cudaSetDevice(index);
  }
  // Queries a kernel of this build: this fails if it was built for other architectures.
  cudaFuncAttributes attributes;
  if (result == cudaSuccess) result = cudaFuncGetAttributes(&attributes, cuda::run_items<Fill<std::uint32_t>>);
  info.available = result == cudaSuccess;
  if (!info.available) {
    info.why_not = cudaGetErrorString(result);
    (void)cudaGetLastError();
  }
  return info;
}

}  // namespace

std::vector<DeviceInfo> cuda_device_infos() {
  int count = 0;
  const cudaError_t result = cudaGetDeviceCount(&count);
  std::vector<DeviceInfo> all;
  for (int index = 0; result == cudaSuccess && index < count; ++index) all.push_back(describe(index));
  if (all.empty()) {
    (void)cudaGetLastError();
    DeviceInfo info;
    info.backend = Backend::cuda;
    info.why_not = result == cudaSuccess ? "no CUDA device was found" : cudaGetErrorString(result);
    all.push_back(info);
  }
  return all;
}

CudaDevice::CudaDevice(int index, Where where) {
  info_ = describe(index);
  if (!info_.available) {
    throw DeviceError(ErrorCode::unavailable,
                      "device cuda:" + std::to_string(index) + " is not available: " + info_.why_not, 0, where);
  }
  bind();
  cuda::check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "creating a stream", where);
  cuda::check(cudaStreamCreateWithFlags(&ahead_, cudaStreamNonBlocking), "creating a stream", where);
  cuda::check(cudaStreamCreateWithFlags(&aside_, cudaStreamNonBlocking), "creating a stream", where);
  cuda::check(cudaEventCreateWithFlags(&fork_, cudaEventDisableTiming), "creating an event", where);
  cuda::check(cudaMalloc(&barrier_, sizeof *barrier_), "allocating the word of the grid's barrier", where);
  cuda::check(cudaMemsetAsync(barrier_, 0, sizeof *barrier_, stream_), "clearing the word of the grid's barrier",
              where);
  int has_clusters = 0;
  cuda::check(cudaDeviceGetAttribute(&has_clusters, cudaDevAttrClusterLaunch, index), "asking for clusters", where);
  if (has_clusters) cluster_blocks_ = cuda::max_cluster_blocks;
}

void CudaDevice::launch_cluster(const void* kernel, std::uint32_t wanted, std::uint32_t size, void** arguments,
                                const Where& where) {
  const std::uint32_t blocks = std::bit_ceil(std::min(wanted, cluster_blocks_));
  cudaLaunchAttribute attributes[2]{};
  attributes[0].id = cudaLaunchAttributeClusterDimension;
  attributes[0].val.clusterDim = {blocks, 1, 1};
  attributes[1].id = cudaLaunchAttributeProgrammaticStreamSerialization;
  attributes[1].val.programmaticStreamSerializationAllowed = 1;
  cudaLaunchConfig_t config{};
  config.gridDim = dim3(blocks);
  config.blockDim = dim3(size + cuda::warp_size);
  config.stream = stream_;
  config.attrs = attributes;
  config.numAttrs = follows_early() ? 2 : 1;
  // Not every GPU with clusters guarantees more than 8 blocks.
  if (blocks > 8)
    cuda::check(cudaFuncSetAttribute(kernel, cudaFuncAttributeNonPortableClusterSizeAllowed, 1), "sizing a cluster",
                where);
  cuda::check(cudaLaunchKernelExC(&config, kernel, arguments), "launching parallel_phases", where);
}

void CudaDevice::launch_cooperatively(const void* kernel, std::uint32_t wanted, std::uint32_t size,
                                      bool has_barrier_warp, void** arguments, const Where& where) {
  const std::uint32_t threads = size + (has_barrier_warp ? cuda::warp_size : 0);
  int resident = 0;  // blocks that fit on a multiprocessor at once
  cuda::check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&resident, kernel, static_cast<int>(threads), 0),
              "sizing parallel_phases", where);
  // More blocks wait longer for each other; they are worthwhile where they hide memory latency.
  const bool many = wanted > max_warps_of_few(size);
  const std::uint32_t max_blocks = (many ? static_cast<std::uint32_t>(resident) : 1u) * info_.compute_units;
  cuda::check(
      cudaLaunchCooperativeKernel(kernel, dim3(std::min(max_blocks, wanted)), dim3(threads), arguments, 0, stream_),
      "launching parallel_phases", where);
}

CudaDevice::~CudaDevice() {
  bind();
  (void)cudaStreamSynchronize(stream_);
  (void)cudaStreamSynchronize(aside_);
  (void)cudaStreamDestroy(stream_);
  (void)cudaStreamDestroy(ahead_);
  (void)cudaStreamDestroy(aside_);
  (void)cudaEventDestroy(fork_);
  (void)cudaFree(barrier_);
}

void CudaDevice::begin_recording(const Where& where) {
  check_can_record(where);
  bind();
  cuda::StreamGraph::begin(stream_, where);
  set_recording(true);
}

void CudaDevice::abandon_recording() noexcept {
  set_recording(false);
  cuda::StreamGraph::abandon(stream_);
}

CudaDevice::Graph CudaDevice::end_recording(const Traffic& before, const Where& where) {
  Graph graph;
  graph.traffic_ = traffic_ - before;
  traffic_ = before;
  set_recording(false);
  graph.nodes_ = cuda::StreamGraph::end(stream_, where);
  return graph;
}

void CudaDevice::launch(Graph& graph, Where where) {
  bind();
  traffic_ += graph.traffic_;
  graph.nodes_.launch(stream_, where);
}

void CudaDevice::mark(Event& event, Where where) {
  bind();
  event.event_.mark(stream_, is_recording(), where);
}

void CudaDevice::mark_aside(Event& event, Where where) {
  bind();
  event.event_.mark(aside_, false, where);
}

void CudaDevice::wait(Where where) {
  bind();
  cuda::check(cudaStreamSynchronize(stream_), "waiting for the device", where);
  cuda::check(cudaStreamSynchronize(aside_), "waiting for copies", where);
}

void* CudaDevice::do_allocate(std::size_t bytes, const Where& where) {
  bind();
  void* memory = nullptr;
  cuda::check(cudaMalloc(&memory, bytes), "allocating device memory", where, bytes);
  return memory;
}

void* CudaDevice::do_allocate_pinned(std::size_t bytes, const Where& where) {
  bind();
  void* memory = nullptr;
  cuda::check(cudaHostAlloc(&memory, bytes, cudaHostAllocPortable), "allocating pinned memory", where, bytes);
  return memory;
}

void CudaDevice::do_release(void* memory) noexcept {
  bind();
  (void)cudaStreamSynchronize(stream_);
  (void)cudaStreamSynchronize(ahead_);
  (void)cudaFree(memory);
}

void CudaDevice::release_pinned(void* memory) noexcept {
  bind();
  (void)cudaStreamSynchronize(stream_);
  (void)cudaStreamSynchronize(ahead_);
  (void)cudaFreeHost(memory);
}

void CudaDevice::submit_copy(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind, const Where& where) {
  if (bytes == 0) return;
  bind();
  cuda::check(cudaMemcpyAsync(to, from, bytes, kind, stream_), "copying", where, bytes);
}

void CudaDevice::submit_copy_ahead(void* to, const void* from, std::size_t bytes, const Where& where) {
  if (bytes == 0) return;
  bind();
  cuda::check(cudaMemcpyAsync(to, from, bytes, cudaMemcpyHostToDevice, ahead_), "copying", where, bytes);
  cuda::check(cudaEventRecord(fork_, ahead_), "marking where a copy meets the queue", where);
  cuda::check(cudaStreamWaitEvent(stream_, fork_), "marking where a copy meets the queue", where);
}

void CudaDevice::submit_copy_aside(void* to, const void* from, std::size_t bytes, const Where& where) {
  if (bytes == 0) return;
  bind();
  cuda::check(cudaEventRecord(fork_, stream_), "marking where a copy leaves the queue", where);
  cuda::check(cudaStreamWaitEvent(aside_, fork_), "marking where a copy leaves the queue", where);
  cuda::check(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, aside_), "copying", where, bytes);
}

void CudaDevice::submit_zero(void* to, std::size_t bytes, const Where& where) {
  if (bytes == 0) return;
  bind();
  cuda::check(cudaMemsetAsync(to, 0, bytes, stream_), "zeroing", where, bytes);
}

}  // namespace fathom::exec
