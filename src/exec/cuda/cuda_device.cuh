// A CUDA GPU as a device: one stream, plain allocations, the driver's graphs.
//
// For translation units that nvcc compiles: it instantiates the kernels. Sorts, scans and selections are compiled
// once, in primitives.cu.
#pragma once

#include <cuda_runtime.h>

#include <algorithm>
#include <cstdint>

#include "exec/cuda/check.hpp"
#include "exec/cuda/launch.cuh"
#include "exec/cuda/stream.hpp"
#include "exec/device.hpp"

namespace fathom::exec {

class CudaDevice final : public Memory {
 public:
  /// A point in the stream. An unmarked event counts as done.
  class Event {
   public:
    explicit Event(CudaDevice& device) : event_(device.info().index) {}

    bool is_done() const { return event_.is_done(); }
    void wait() const { event_.wait(); }
    double milliseconds_since(const Event& begin) const { return event_.milliseconds_since(begin.event_); }

   private:
    friend class CudaDevice;
    cuda::StreamEvent event_;
  };

  class Graph {
   public:
    /// Nodes that the driver replays: kernels, copies and fills.
    std::size_t size() const { return nodes_.size(); }

   private:
    friend class CudaDevice;
    Graph() = default;
    cuda::StreamGraph nodes_;
    Traffic traffic_;
  };

  explicit CudaDevice(int index = 0, Where where = Where::current());
  ~CudaDevice() override;

  const DeviceInfo& info() const { return info_; }
  const Traffic& traffic() const { return traffic_; }
  cudaStream_t stream() const { return stream_; }

  template <ItemKernel Kernel>
  void parallel_for(Range range, Kernel kernel, Where where = Where::current()) {
    check_items(range.capacity, where);
    if (range.capacity == 0) return;
    constexpr std::uint32_t size = items_per_group<Kernel>();
    start_launch();
    launch_kernel(cuda::run_items<Kernel>, blocks_for(range, size / cuda::work_items_each<Kernel>()), size, where,
                  range, kernel);
  }

  template <GroupKernel Kernel>
  void parallel_groups(Range groups, Kernel kernel, Where where = Where::current()) {
    check_items(groups.capacity, where);
    if (groups.capacity == 0) return;
    start_launch();
    launch_kernel(cuda::run_groups<Kernel>, blocks_for(groups, 1), Kernel::group_size, where, groups, kernel);
  }

  template <PhaseKernel Kernel>
  void parallel_phases(std::uint32_t max_phases, std::uint32_t max_phase_items, Kernel kernel,
                       Where where = Where::current()) {
    check_items(max_phase_items, where);
    if (max_phases == 0 || max_phase_items == 0) return;
    constexpr std::uint32_t size = items_per_group<Kernel>();
    auto with_plan = planned(kernel);
    using Planned = decltype(with_plan);
    start_launch();
    void* arguments[] = {&max_phases, &max_phase_items, &barrier_, &with_plan};
    // One cluster waits half as long as a grid, but has an eighth of its multiprocessors.
    const std::uint32_t warps = (max_phase_items + 31) / 32;
    constexpr bool ends_at_empty = ends_at_empty_phase<Kernel>();
    if (cluster_blocks_ > 0 && (has_few_items<Kernel>() || max_phase_items <= size * cluster_blocks_)) {
      const auto function = cuda::run_phases<cuda::ClusterBarrier, Planned, size, ends_at_empty>;
      launch_cluster(reinterpret_cast<const void*>(function), warps, size, arguments, where);
    } else if (warps <= max_warps_of_few(size)) {
      const auto function = cuda::run_phases<cuda::GridBarrier<true>, Planned, size, ends_at_empty>;
      launch_cooperatively(reinterpret_cast<const void*>(function), warps, size, true, arguments, where);
    } else {
      const auto function = cuda::run_phases<cuda::GridBarrier<false>, Planned, size, ends_at_empty>;
      launch_cooperatively(reinterpret_cast<const void*>(function), warps, size, false, arguments, where);
    }
  }

  template <class T>
  void copy_to_device(T* to, const T* from, std::size_t size, Where where = Where::current()) {
    traffic_.bytes_to_device += size * sizeof(T);
    submit_copy(to, from, size * sizeof(T), cudaMemcpyHostToDevice, where);
  }
  template <class T>
  void copy_to_host(T* to, const T* from, std::size_t size, Where where = Where::current()) {
    traffic_.bytes_to_host += size * sizeof(T);
    submit_copy(to, from, size * sizeof(T), cudaMemcpyDeviceToHost, where);
  }
  template <class T>
  void copy_to_device_aside(T* to, const T* from, std::size_t size, Where where = Where::current()) {
    traffic_.bytes_to_device += size * sizeof(T);
    submit_copy_ahead(to, from, size * sizeof(T), where);
  }
  template <class T>
  void copy_to_host_aside(T* to, const T* from, std::size_t size, Where where = Where::current()) {
    traffic_.bytes_to_host += size * sizeof(T);
    submit_copy_aside(to, from, size * sizeof(T), where);
  }
  template <class T>
  void copy(T* to, const T* from, std::size_t size, Where where = Where::current()) {
    submit_copy(to, from, size * sizeof(T), cudaMemcpyDeviceToDevice, where);
  }
  template <class T>
  void zero(T* to, std::size_t size, Where where = Where::current()) {
    submit_zero(to, size * sizeof(T), where);
  }
  template <class T>
  void fill(T* to, std::size_t size, T value, Where where = Where::current()) {
    parallel_for(Range::of(size, where), Fill<T>{to, value}, where);
  }

  /// Key is std::uint32_t or std::uint64_t. A count in device memory costs a pass over the capacity: items beyond the
  /// count sort to the end as ones, and are left unspecified.
  template <class Key>
  void sort_by_key(Scratch& scratch, Range range, Key* keys, std::uint32_t* values, int key_bits = 8 * sizeof(Key),
                   Where where = Where::current());
  /// out[i] = in[0] + … + in[i−1] modulo 2³², in place if in == out; the sum of all goes to `total` unless null, which
  /// must not be the range's own count.
  void exclusive_scan(Scratch& scratch, Range range, const std::uint32_t* in, std::uint32_t* out,
                      std::uint32_t* total = nullptr, Where where = Where::current());
  /// Writes the indices of the nonzero flags, in ascending order, and their number.
  void select(Scratch& scratch, Range range, const std::uint32_t* flags, std::uint32_t* indices, std::uint32_t* count,
              Where where = Where::current());

  template <class Key>
  std::size_t sort_scratch_bytes(std::uint32_t capacity) const;
  std::size_t scan_scratch_bytes(std::uint32_t capacity) const;
  std::size_t select_scratch_bytes(std::uint32_t capacity) const;

  template <class Submissions>
  Graph record(Submissions&& submissions, Where where = Where::current()) {
    begin_recording(where);
    const Traffic before = traffic_;
    try {
      submissions();
    } catch (...) {
      abandon_recording();
      traffic_ = before;
      throw;
    }
    return end_recording(before, where);
  }
  void launch(Graph& graph, Where where = Where::current());

  void mark(Event& event, Where where = Where::current());
  void mark_aside(Event& event, Where where = Where::current());
  void wait(Where where = Where::current());

  void copy_bytes(void* to, const void* from, std::size_t bytes, const Where& where) override {
    submit_copy(to, from, bytes, cudaMemcpyDeviceToDevice, where);
  }
  void release_pinned(void* memory) noexcept override;

 private:
  void* do_allocate(std::size_t bytes, const Where& where) override;
  void* do_allocate_pinned(std::size_t bytes, const Where& where) override;
  void do_release(void* memory) noexcept override;

  /// All blocks in one cluster, whose barrier is several times as fast for a few blocks.
  void launch_cluster(const void* kernel, std::uint32_t wanted, std::uint32_t size, void** arguments,
                      const Where& where);
  void launch_cooperatively(const void* kernel, std::uint32_t wanted, std::uint32_t size, bool has_barrier_warp,
                            void** arguments, const Where& where);
  /// Number of warps per phase up to which blocks wait more for each other than for memory.
  std::uint32_t max_warps_of_few(std::uint32_t size) const { return 4 * info_.compute_units * size / cuda::warp_size; }

  /// Whether a kernel may be set up while the previous one still runs.
  bool follows_early() const { return cluster_blocks_ > 0; }  // compute capability 9.0 has both

  template <class... Arguments>
  void launch_kernel(void (*function)(Arguments...), std::uint32_t blocks, std::uint32_t size, const Where& where,
                     Arguments... arguments) {
    cudaLaunchAttribute attribute{};
    attribute.id = cudaLaunchAttributeProgrammaticStreamSerialization;
    attribute.val.programmaticStreamSerializationAllowed = 1;
    cudaLaunchConfig_t config{};
    config.gridDim = dim3(blocks);
    config.blockDim = dim3(size);
    config.stream = stream_;
    config.attrs = &attribute;
    config.numAttrs = follows_early() ? 1 : 0;
    cuda::check(cudaLaunchKernelEx(&config, function, arguments...), "launching a kernel", where);
  }
  void submit_copy(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind, const Where& where);
  void submit_copy_ahead(void* to, const void* from, std::size_t bytes, const Where& where);
  void submit_copy_aside(void* to, const void* from, std::size_t bytes, const Where& where);
  void submit_zero(void* to, std::size_t bytes, const Where& where);
  void begin_recording(const Where& where);
  void abandon_recording() noexcept;
  Graph end_recording(const Traffic& before, const Where& where);

  /// The runtime's current device is per thread, and any thread may submit.
  void bind() const { (void)cudaSetDevice(info_.index); }
  void start_launch() {
    bind();
    ++traffic_.launches;
  }

  /// Blocks of a grid-stride launch. As many as needed if the count is known. Otherwise blocks without work still cost
  /// their start, so at most 16 per multiprocessor: one or two full loads.
  std::uint32_t blocks_for(Range range, std::uint32_t group_size) const {
    const std::uint32_t needed = (range.capacity + group_size - 1) / group_size;
    return range.count ? std::min(needed, 16 * info_.compute_units) : needed;
  }

  DeviceInfo info_;
  Traffic traffic_;
  cudaStream_t stream_ = nullptr;
  cudaStream_t ahead_ = nullptr;  ///< for copies that do not wait for kernels
  cudaStream_t aside_ = nullptr;  ///< for copies that kernels do not wait for
  cudaEvent_t fork_ = nullptr;    ///< where a copy forks from or joins the stream
  std::uint32_t* barrier_ =
      nullptr;  ///< the word of GridBarrier; one suffices, because launches in a stream are sequential
  std::uint32_t cluster_blocks_ = 0;  ///< blocks of the largest cluster used, 0 if the GPU has no clusters
};

static_assert(Device<CudaDevice>);

}  // namespace fathom::exec
