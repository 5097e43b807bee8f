// A SYCL 2020 device through AdaptiveCpp: one in-order queue, unified shared memory.
//
// For translation units compiled by a SYCL compiler. On an NVIDIA GPU the queue is a CUDA stream, which provides events
// and graphs; elsewhere graphs are closures. docs/execution.md lists the relevant environment variables.
#pragma once

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <sycl/sycl.hpp>
#include <utility>

#include "exec/closure_queue.hpp"
#include "exec/host/host_group.hpp"
#include "exec/portable/radix_sort.hpp"
#include "exec/sycl/adaptive_cpp.hpp"
#include "exec/sycl/grid_phases.hpp"
#include "exec/sycl/sycl_group.hpp"

namespace fathom::exec {

/// One phase as a separate kernel: each group makes the plan again.
template <class Kernel, std::uint32_t Size>
struct RunPhase {
  static constexpr std::uint32_t group_size = Size;
  struct Local {
    typename Kernel::Plan plan;
  };

  Kernel kernel;
  std::uint32_t phase;
  std::uint32_t max_phase_items;
  std::uint32_t groups;

  FATHOM_HD void operator()(auto group, Local& local) const {
    const typename Kernel::Plan& plan = local.plan;
    if constexpr (Kernel::plan_parts > 0) {
      group.for_each(Kernel::plan_parts, [&](std::uint32_t k) { kernel.plan_part(local.plan, k); });
    }
    if (phase >= kernel.phases(plan)) return;
    const auto cursor = kernel.cursor_at(plan, phase);
    group.for_each([&](std::uint32_t item) {
      const std::uint32_t first = group.index() * Size + item;
      run_share(kernel, plan, cursor, share_of(kernel, plan, cursor, first, groups * Size, max_phase_items));
    });
  }
};

class SyclDevice final : public ClosureQueue {
 public:
  /// A point in the queue. An unmarked event counts as done.
  class Event {
   public:
    explicit Event(SyclDevice& device) {
      if (device.stream_) native_.emplace(adaptive_cpp::native_index(device.queue_));
    }

    bool is_done() const;
    void wait() const;
    double milliseconds_since(const Event& begin) const;

   private:
    friend class SyclDevice;
    sycl::event get() const;
    void set(const sycl::event& event);

    std::optional<cuda::StreamEvent> native_;  // used instead of the others if the queue is a CUDA stream
    mutable std::mutex mutex_;                 // a replayed graph marks again while another thread may query
    sycl::event event_;
  };

  class Graph {
   public:
    /// Nodes that the driver replays, or closures.
    std::size_t size() const { return nodes_.size() + closures_.size(); }

   private:
    friend class SyclDevice;
    Graph() = default;
    cuda::StreamGraph nodes_;
    Traffic traffic_;  // of the nodes; closures count their own
    ClosureQueue::Graph closures_;
  };

  explicit SyclDevice(int index = 0, Where where = Where::current());
  ~SyclDevice() override;

  const DeviceInfo& info() const { return info_; }

  template <class Submissions>
  Graph record(Submissions&& submissions, Where where = Where::current()) {
    Graph graph;
    if (!stream_) {
      graph.closures_ = ClosureQueue::record(submissions, where);
      return graph;
    }
    check_can_record(where);
    cuda::StreamGraph::begin(stream_, where);
    set_recording(true);
    const Traffic before = traffic_;
    try {
      submissions();
    } catch (...) {
      set_recording(false);
      cuda::StreamGraph::abandon(stream_);
      traffic_ = before;
      throw;
    }
    set_recording(false);
    graph.traffic_ = traffic_ - before;
    traffic_ = before;
    graph.nodes_ = cuda::StreamGraph::end(stream_, where);
    return graph;
  }
  void launch(Graph& graph, Where where = Where::current());

  template <ItemKernel Kernel>
  void parallel_for(Range range, Kernel kernel, Where where = Where::current()) {
    check_items(range.capacity, where);
    if (range.capacity == 0) return;
    constexpr std::uint32_t size = items_per_group<Kernel>();
    const std::uint32_t groups = groups_for(range, size);
    launch_kernel("launching parallel_for", where, [=](sycl::handler& handler) {
      handler.parallel_for(nd_range(groups, size),
                           [=](sycl::nd_item<1> work_item) { for_each_item(work_item, range.size(), kernel); });
    });
  }

  template <GroupKernel Kernel>
  void parallel_groups(Range groups, Kernel kernel, Where where = Where::current()) {
    check_items(groups.capacity, where);
    if (groups.capacity == 0) return;
    const std::uint32_t launched = groups_for(groups, 1);
    if (info_.is_gpu) {
      launch_kernel("launching parallel_groups", where, [=](sycl::handler& handler) {
        constexpr std::uint32_t size = Kernel::group_size;
        const sycl::local_accessor<typename Kernel::Local, 1> local(sycl::range<1>(1), handler);
        handler.parallel_for(nd_range(launched, size), [=](sycl::nd_item<1> work_item) {
          for_each_group(work_item, groups, [&](std::uint32_t i) { kernel(SyclGroup<size>(work_item, i), local[0]); });
        });
      });
    } else {
      // One work-item runs the sections of a whole group as loops. AdaptiveCpp's own loops around barriers are wrong if
      // loops that contain barriers are nested (its issue 2177), and slower.
      launch_kernel("launching parallel_groups", where, [=](sycl::handler& handler) {
        handler.parallel_for(nd_range(launched, 1), [=](sycl::nd_item<1> work_item) {
          typename Kernel::Local local;
          for_each_group(work_item, groups, [&](std::uint32_t i) { kernel(HostGroup<Kernel::group_size>(i), local); });
        });
      });
    }
  }

  /// One launch if work-groups may wait for each other, else one per phase: on GPUs for the maximum number of phases;
  /// on CPUs the host waits and reads their number, because it shares their memory.
  template <PhaseKernel Kernel>
  void parallel_phases(std::uint32_t max_phases, std::uint32_t max_phase_items, Kernel kernel,
                       Where where = Where::current()) {
    check_items(max_phase_items, where);
    if (max_phases == 0 || max_phase_items == 0) return;
    constexpr std::uint32_t size = items_per_group<Kernel>();
    const auto with_plan = planned(kernel);
    if (grid_barrier_) {
      using Plan = typename decltype(planned(kernel))::Plan;
      const std::uint32_t resident = resident_groups(max_phase_items, size, has_few_items<Kernel>());
      std::uint32_t* const barrier = grid_barrier_;
      return launch_kernel("launching parallel_phases", where, [=](sycl::handler& handler) {
        const sycl::local_accessor<Plan, 1> plan(sycl::range<1>(1), handler);
        handler.parallel_for(nd_range(resident, size), [=](sycl::nd_item<1> work_item) {
          run_phases<ends_at_empty_phase<Kernel>()>(work_item, barrier, max_phases, max_phase_items, with_plan,
                                                    plan[0]);
        });
      });
    }
    const std::uint32_t groups = groups_for(max_phase_items, size);
    const auto run = [=, this](std::uint32_t phase) {
      parallel_groups(groups, RunPhase<decltype(planned(kernel)), size>{with_plan, phase, max_phase_items, groups},
                      where);
    };
    if (info_.is_gpu) {
      for (std::uint32_t phase = 0; phase < max_phases; ++phase) run(phase);
      return;
    }
    launch_step([=, this] {
      const auto wait = [&] { checked("waiting for a phase", where, [&] { queue_.wait_and_throw(); }); };
      wait();
      typename decltype(planned(kernel))::Plan plan;
      for (std::uint32_t k = 0; k < with_plan.plan_parts; ++k) with_plan.plan_part(plan, k);
      const Traffic before = traffic_;
      for (std::uint32_t phase = 0; phase < max_phases && phase < with_plan.phases(plan); ++phase) {
        if constexpr (ends_at_empty_phase<Kernel>()) {
          if (phase > 0) wait();
          if (with_plan.items(plan, with_plan.cursor_at(plan, phase)) == 0) break;
        }
        run(phase);
      }
      traffic_ = before;
    });
  }

  template <class T>
  void copy_to_device(T* to, const T* from, std::size_t size, Where where = Where::current()) {
    traffic_.bytes_to_device += size * sizeof(T);
    copy_bytes(to, from, size * sizeof(T), where);
  }
  template <class T>
  void copy_to_host(T* to, const T* from, std::size_t size, Where where = Where::current()) {
    traffic_.bytes_to_host += size * sizeof(T);
    copy_bytes(to, from, size * sizeof(T), where);
  }
  template <class T>
  void copy_to_device_aside(T* to, const T* from, std::size_t size, Where where = Where::current()) {
    copy_to_device(to, from, size, where);
  }
  template <class T>
  void copy_to_host_aside(T* to, const T* from, std::size_t size, Where where = Where::current()) {
    copy_to_host(to, from, size, where);
  }
  template <class T>
  void copy(T* to, const T* from, std::size_t size, Where where = Where::current()) {
    copy_bytes(to, from, size * sizeof(T), where);
  }
  template <class T>
  void zero(T* to, std::size_t size, Where where = Where::current()) {
    submit_zero(to, size * sizeof(T), where);
  }
  template <class T>
  void fill(T* to, std::size_t size, T value, Where where = Where::current()) {
    parallel_for(Range::of(size, where), Fill<T>{to, value}, where);
  }

  /// Key is std::uint32_t or std::uint64_t.
  template <class Key>
  void sort_by_key(Scratch& scratch, Range range, Key* keys, std::uint32_t* values, int key_bits = 8 * sizeof(Key),
                   Where where = Where::current()) {
    count_as_one([&] { portable::sort_by_key(*this, scratch, range, keys, values, key_bits, where); });
  }
  void exclusive_scan(Scratch& scratch, Range range, const std::uint32_t* in, std::uint32_t* out,
                      std::uint32_t* total = nullptr, Where where = Where::current()) {
    count_as_one([&] { portable::exclusive_scan(*this, scratch, range, in, out, total, where); });
  }
  void select(Scratch& scratch, Range range, const std::uint32_t* flags, std::uint32_t* indices, std::uint32_t* count,
              Where where = Where::current()) {
    count_as_one([&] { portable::select(*this, scratch, range, flags, indices, count, where); });
  }

  template <class Key>
  std::size_t sort_scratch_bytes(std::uint32_t capacity) const {
    return portable::SortScratch<Key>(nullptr, capacity).bytes;
  }
  std::size_t scan_scratch_bytes(std::uint32_t capacity) const { return portable::scan_scratch_bytes(capacity); }
  std::size_t select_scratch_bytes(std::uint32_t capacity) const { return portable::scan_scratch_bytes(capacity); }

  void mark(Event& event, Where where = Where::current());
  void mark_aside(Event& event, Where where = Where::current()) { mark(event, where); }
  void wait(Where where = Where::current());

  void copy_bytes(void* to, const void* from, std::size_t bytes, const Where& where) override;
  void release_pinned(void* memory) noexcept override;

 private:
  void* do_allocate(std::size_t bytes, const Where& where) override;
  void* do_allocate_pinned(std::size_t bytes, const Where& where) override;
  void do_release(void* memory) noexcept override;
  void submit_zero(void* to, std::size_t bytes, const Where& where);

  /// Calls work() and converts SYCL's exceptions, synchronous or from the queue's handler, to DeviceError.
  template <class Work>
  auto checked(const char* what, const Where& where, Work work, std::size_t bytes = 0) const {
    try {
      if constexpr (std::is_void_v<decltype(work())>) {
        work();
        throw_asynchronous();
      } else {
        auto result = work();
        throw_asynchronous();
        return result;
      }
    } catch (const sycl::exception& error) {
      const bool is_lost = stream_ && cuda::is_lost(stream_);
      throw DeviceError(is_lost ? ErrorCode::unavailable : ErrorCode::capacity,
                        std::string(what) + ": " + error.what() + (is_lost ? "; the device is lost" : ""), bytes,
                        where);
    }
  }

  /// The runtime lists failures of submissions instead of throwing them.
  void throw_asynchronous() const { const_cast<sycl::queue&>(queue_).throw_asynchronous(); }

  template <class Fill>
  void launch_kernel(const char* what, const Where& where, Fill fill_handler) {
    launch_step(
        [this, what, where, fill_handler] { checked(what, where, [&] { queue_.submit(no_event_, fill_handler); }); });
  }

  template <class Work>
  void count_as_one(Work work) {
    const std::uint64_t launches = traffic_.launches;
    work();
    traffic_.launches = launches + 1;
  }

  static sycl::nd_range<1> nd_range(std::uint32_t groups, std::uint32_t size) {
    return {sycl::range<1>(std::size_t{groups} * size), sycl::range<1>(size)};
  }

  template <class Body>
  static void for_each_item(const sycl::nd_item<1>& work_item, std::uint32_t n, const Body& body) {
    const auto stride = static_cast<std::uint32_t>(work_item.get_global_range(0));
    for (auto i = static_cast<std::uint32_t>(work_item.get_global_linear_id()); i < n; i += stride) body(i);
  }

  template <class Body>
  static void for_each_group(const sycl::nd_item<1>& work_item, Range groups, const Body& body) {
    const std::uint32_t n = groups.size();
    const auto stride = static_cast<std::uint32_t>(work_item.get_group_range(0));
    for (auto i = static_cast<std::uint32_t>(work_item.get_group_linear_id()); i < n; i += stride) body(i);
  }

  /// As many as a known count needs; if the count is on the device, at most 16 per compute unit.
  std::uint32_t groups_for(Range range, std::uint32_t size) const {
    const std::uint32_t needed = (range.capacity + size - 1) / size;
    const std::uint32_t most = 16 * info_.compute_units;
    return range.count && most < needed ? most : needed;
  }

  /// Groups of a launch that wait for each other. Items that fit in one group need no barrier; more are processed
  /// fastest on many compute units (H100: pyramids of 1,240 and 9,455 bodies take 13 % less than with full groups).
  std::uint32_t resident_groups(std::uint32_t max_phase_items, std::uint32_t size, bool few_items) const {
    if (max_phase_items <= size) return 1;
    const std::uint32_t most =
        few_items ? std::min(info_.compute_units, max_groups_with_few_items) : info_.compute_units;
    return std::min(most, (max_phase_items + items_of_resident_group - 1) / items_of_resident_group);
  }

  DeviceInfo info_;
  sycl::queue queue_;
  cuda::Stream stream_;                    // the queue's CUDA stream, else null
  std::uint32_t* grid_barrier_ = nullptr;  // the barrier's word, if work-groups may wait for each other
  // On CPUs, where AdaptiveCpp makes several queues wait for each other, submissions without events block them.
  sycl::property_list no_event_ = stream_ ? adaptive_cpp::without_event() : sycl::property_list();
};

static_assert(Device<SyclDevice>);

}  // namespace fathom::exec
