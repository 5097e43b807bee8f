// The Device concept: what a back end offers to code that is written once. docs/execution.md describes it as a whole.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>

#include "exec/buffer.hpp"
#include "exec/devices.hpp"
#include "exec/kernel.hpp"
#include "exec/range.hpp"
#include "exec/scratch.hpp"

namespace fathom::exec {

/// Totals of all submissions so far. A sort, scan or selection counts as one launch, a graph as everything that it
/// replays.
struct Traffic {
  std::uint64_t launches = 0;
  std::uint64_t bytes_to_device = 0;
  std::uint64_t bytes_to_host = 0;

  Traffic& operator+=(const Traffic& other) {
    launches += other.launches;
    bytes_to_device += other.bytes_to_device;
    bytes_to_host += other.bytes_to_host;
    return *this;
  }
  friend Traffic operator-(Traffic a, const Traffic& b) {
    a.launches -= b.launches;
    a.bytes_to_device -= b.bytes_to_device;
    a.bytes_to_host -= b.bytes_to_host;
    return a;
  }
};

namespace archetype {

struct Items {
  FATHOM_HD void operator()(std::uint32_t) const {}
};
struct Groups {
  static constexpr std::uint32_t group_size = 32;
  struct Local {};
  FATHOM_HD void operator()(auto, Local&) const {}
};
struct Phases {
  FATHOM_HD std::uint32_t phases() const { return 0; }
  FATHOM_HD std::uint32_t items(std::uint32_t) const { return 0; }
  FATHOM_HD void operator()(std::uint32_t, std::uint32_t) const {}
};
struct Submissions {
  void operator()() const {}
};

}  // namespace archetype

/// A device runs submissions one after the other, in the order they were made (one in-order queue), and most calls
/// return before they have run. Only one thread at a time submits; any thread may query events.
///
/// Every submission also takes a source location (defaulted to the caller's), which a DeviceError then names.
template <class D>
concept Device = std::derived_from<D, Memory> &&
    requires(D& device, const D& observed, Scratch& scratch, Range range, std::uint32_t n, std::size_t size,
             std::uint32_t* words, const std::uint32_t* read_words, std::uint64_t* long_words, typename D::Event& event,
             const typename D::Event& observed_event, typename D::Graph& graph) {
  { observed.info() } -> std::same_as<const DeviceInfo&>;
  { observed.traffic() } -> std::same_as<const Traffic&>;

  // Kernels.
  device.parallel_for(range, archetype::Items{});
  device.parallel_groups(range, archetype::Groups{});  // the range counts work-groups
  device.parallel_phases(n, n, archetype::Phases{});   // most phases, most items of a phase

  // Copies of `size` items; the host's memory is pinned and stays untouched until the copy is done.
  device.copy_to_device(words, read_words, size);
  device.copy_to_host(words, read_words, size);
  device.copy(words, read_words, size);
  // Outside the queue, where the back end can: copies to the device start at once, and later submissions wait for them;
  // copies to the host start when all earlier submissions are done, and nothing waits for them. `mark_aside` marks the
  // end of the latter.
  device.copy_to_device_aside(words, read_words, size);
  device.copy_to_host_aside(words, read_words, size);
  device.mark_aside(event);
  device.zero(words, size);
  device.fill(words, size, n);

  // Primitives over 32-bit items; sorting is stable, in place, by the lowest `key_bits` bits.
  device.sort_by_key(scratch, range, words, words, int{32});
  device.sort_by_key(scratch, range, long_words, words, int{64});
  device.exclusive_scan(scratch, range, read_words, words, words);
  device.select(scratch, range, read_words, words, words);
  { observed.template sort_scratch_bytes<std::uint32_t>(n) } -> std::same_as<std::size_t>;
  { observed.template sort_scratch_bytes<std::uint64_t>(n) } -> std::same_as<std::size_t>;
  { observed.scan_scratch_bytes(n) } -> std::same_as<std::size_t>;
  { observed.select_scratch_bytes(n) } -> std::same_as<std::size_t>;

  // Graphs: the function's submissions are recorded instead of run, and replayed by launch.
  { device.record(archetype::Submissions{}) } -> std::same_as<typename D::Graph>;
  device.launch(graph);

  // Time and completion.
  requires std::constructible_from<typename D::Event, D&>;
  device.mark(event);
  { observed_event.is_done() } -> std::same_as<bool>;
  observed_event.wait();
  { observed_event.milliseconds_since(observed_event) } -> std::same_as<double>;
  device.wait();
};

}  // namespace fathom::exec
