// The host as a device: kernels run as loops on a pool of threads, and submissions return when done.
//
// Any number of threads gives the same results: a kernel's items are independent, and the primitives divide their work
// by the number of items only.
#pragma once

#include <atomic>
#include <cstdint>
#include <utility>

#include "exec/closure_queue.hpp"
#include "exec/host/faults.hpp"
#include "exec/host/host_group.hpp"
#include "exec/phases.hpp"
#include "threads/thread_pool.hpp"

namespace fathom::exec {

class HostDevice : public ClosureQueue {
 public:
  /// A point in the queue. All submissions have run, so every point has been passed.
  class Event {
   public:
    explicit Event(HostDevice&) {}

    bool is_done() const { return is_done_; }
    void wait() const { is_done_ = true; }
    double milliseconds_since(const Event& begin) const;

   private:
    friend class HostDevice;
    std::atomic<std::int64_t> nanoseconds_{0};
    mutable std::atomic<bool> is_done_{true};
  };

  /// `threads` includes the submitting thread; 0 uses all threads of the machine.
  explicit HostDevice(int threads = 0);

  const DeviceInfo& info() const { return info_; }
  int thread_count() const { return pool_.thread_count(); }

  template <ItemKernel Kernel>
  void parallel_for(Range range, Kernel kernel, Where where = Where::current()) {
    check_items(range.capacity, where);
    launch_step([this, range, kernel] {
      for_each_chunk(range.size(), 64,
                     [kernel](std::size_t begin, std::size_t end) { for_each_item(begin, end, kernel); });
    });
  }

  template <GroupKernel Kernel>
  void parallel_groups(Range groups, Kernel kernel, Where where = Where::current()) {
    check_items(groups.capacity, where);
    launch_step([this, groups, kernel] {
      for_each_chunk(groups.size(), 1, [&kernel](std::size_t begin, std::size_t end) {
        typename Kernel::Local local;
        for (std::size_t i = begin; i < end; ++i) {
          kernel(HostGroup<Kernel::group_size>(static_cast<std::uint32_t>(i)), local);
        }
      });
    });
  }

  template <PhaseKernel Kernel>
  void parallel_phases(std::uint32_t max_phases, std::uint32_t max_phase_items, Kernel kernel,
                       Where where = Where::current()) {
    check_items(max_phase_items, where);
    launch_step([this, max_phases, max_phase_items, kernel = planned(kernel)] {
      typename decltype(kernel)::Plan plan;
      for (std::uint32_t k = 0; k < kernel.plan_parts; ++k) kernel.plan_part(plan, k);
      auto cursor = kernel.cursor_at(plan, 0);
      // The number of phases may become known only while they run.
      for (std::uint32_t phase = 0; phase < within(kernel, kernel.phases(plan), max_phases); ++phase) {
        if (phase > 0) cursor = kernel.next(plan, cursor);
        const ItemShare all = share_of(kernel, plan, cursor, 0, 1, max_phase_items);
        if (ends_at_empty_phase<Kernel>() && all.end == 0) return;
        for_each_chunk(all.end, 64, [&](std::size_t begin, std::size_t end) {
          run_share(kernel, plan, cursor, {static_cast<std::uint32_t>(begin), 1, static_cast<std::uint32_t>(end)});
        });
      }
    });
  }

  template <class T>
  void copy_to_device(T* to, const T* from, std::size_t size, Where where = Where::current()) {
    check_alive(where);
    traffic_.bytes_to_device += size * sizeof(T);
    submit_copy(to, from, size * sizeof(T));
  }
  template <class T>
  void copy_to_host(T* to, const T* from, std::size_t size, Where where = Where::current()) {
    check_alive(where);
    traffic_.bytes_to_host += size * sizeof(T);
    submit_copy(to, from, size * sizeof(T));
  }
  template <class T>
  void copy_to_device_aside(T* to, const T* from, std::size_t size, Where = Where::current()) {
    copy_to_device(to, from, size);
  }
  template <class T>
  void copy_to_host_aside(T* to, const T* from, std::size_t size, Where = Where::current()) {
    copy_to_host(to, from, size);
  }
  template <class T>
  void copy(T* to, const T* from, std::size_t size, Where = Where::current()) {
    submit_copy(to, from, size * sizeof(T));
  }
  template <class T>
  void zero(T* to, std::size_t size, Where = Where::current()) {
    submit_zero(to, size * sizeof(T));
  }
  template <class T>
  void fill(T* to, std::size_t size, T value, Where where = Where::current()) {
    parallel_for(Range::of(size, where), Fill<T>{to, value}, where);
  }

  /// Key is std::uint32_t or std::uint64_t.
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
  std::size_t select_scratch_bytes(std::uint32_t capacity) const { return scan_scratch_bytes(capacity); }

  void launch(Graph& graph, Where where = Where::current()) {
    check_alive(where);
    ClosureQueue::launch(graph, where);
  }
  void mark(Event& event, Where = Where::current());
  void mark_aside(Event& event, Where = Where::current()) { mark(event); }
  void wait(Where where = Where::current()) { check_alive(where); }

  void copy_bytes(void* to, const void* from, std::size_t bytes, const Where&) override {
    submit_copy(to, from, bytes);
  }
  void release_pinned(void* memory) noexcept override;

 private:
  void* do_allocate(std::size_t bytes, const Where& where) override;
  void* do_allocate_pinned(std::size_t bytes, const Where& where) override;
  void do_release(void* memory) noexcept override;

  /// See HostFaults.
  static void check_alive(const Where& where) {
    std::atomic<std::int64_t>& calls = host_faults.calls;
    if (calls < 0) return;
    if (calls == 0) throw DeviceError(ErrorCode::unavailable, "the device is lost", 0, where);
    --calls;
  }
  static bool allocation_fails() {
    std::atomic<std::int64_t>& left = host_faults.allocations;
    return left >= 0 && left-- == 0;
  }

  void submit_copy(void* to, const void* from, std::size_t bytes);
  void submit_zero(void* to, std::size_t bytes);

  /// 32-bit indices that cannot wrap: compilers can vectorise the loop where the kernel allows it.
  template <class Body>
  static void for_each_item(std::size_t begin, std::size_t end, const Body& body) {
    const auto last = static_cast<std::uint32_t>(end);
    for (auto i = static_cast<std::uint32_t>(begin); i < last; ++i) body(i);
  }

  /// Eight chunks per thread balance items of different cost; at least `least` items per chunk keep cheap items from
  /// costing more to distribute than to run.
  template <class Body>
  void for_each_chunk(std::size_t count, std::size_t least, Body&& body) {
    const std::size_t grain = count / (8 * static_cast<std::size_t>(pool_.thread_count()));
    pool_.for_each_chunk(count, grain > least ? grain : least, std::forward<Body>(body));
  }

  DeviceInfo info_;
  ThreadPool pool_;
};

static_assert(Device<HostDevice>);

}  // namespace fathom::exec
