// The three shapes of a kernel. Each is a plain struct: its members are its arguments (it reads through pointers to
// const and writes through other pointers), its call operator is marked FATHOM_HD and is the same for all back ends.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "fathom/math.hpp"

namespace fathom::exec {

/// Maximum bytes of a kernel's members: every CUDA driver accepts this many as arguments.
inline constexpr std::size_t max_kernel_bytes = 4000;
/// Maximum bytes of local memory per work-group: every GPU offers this many by default.
inline constexpr std::size_t max_local_bytes = 48 * 1024;

template <class K>
concept KernelArguments = std::is_trivially_copyable_v<K> && sizeof(K) <= max_kernel_bytes;

/// One independent call for each item of a range.
template <class K>
concept ItemKernel = KernelArguments<K> && std::invocable<const K&, std::uint32_t>;

/// One call for each work-group, which shares a `Local` and goes through sections (group.hpp):
///
///     struct Local { ... }; trivial, not initialised
///     static constexpr std::uint32_t group_size;     a multiple of 32, at most 1024
///     void operator()(auto group, Local& local) const
template <class K>
concept GroupKernel = KernelArguments<K> && std::is_trivially_default_constructible_v<typename K::Local> &&
                              sizeof(typename K::Local) <= max_local_bytes&& K::group_size % 32 ==
                          0 &&
                      K::group_size >= 32 && K::group_size <= 1024;

/// Phases that follow each other across the whole device: all items of a phase are done, and their writes visible,
/// before any item of the next begins. `phases()` and `items(phase)` are evaluated on the device, so they may depend on
/// an earlier kernel; both must give every work-item the same answer.
template <class K>
concept SimplePhaseKernel = KernelArguments<K> && requires(const K& kernel, std::uint32_t phase, std::uint32_t item) {
  { kernel.phases() } -> std::same_as<std::uint32_t>;
  { kernel.items(phase) } -> std::same_as<std::uint32_t>;
  kernel(phase, item);
};

/// What a phase's items wait for.
enum class Wait : std::uint32_t {
  for_all,   ///< items of the previous phase
  for_warp,  ///< items of the same warp, with equal i / 32
  for_data   ///< their inputs, for which they wait themselves, where `can_wait_for_data` (load.hpp)
};

/// Phases with a plan and prefetching. A work-group keeps one `Plan` in local memory, whose parts its items fill by
/// `plan_part(plan, k)`, k < plan_parts, before the first phase; `cursor_at(plan, phase)` describes a phase, and
/// `next(plan, cursor)` the one after it. An item may load data that no other item writes before its phase begins:
/// `fetch` does this before the items wait for each other, so the loads overlap the wait.
///
/// Optional: `void report_overrun()`, called if there are more phases or items than were launched for; the excess is
/// not run. Optional: `bool may_exceed_launch(plan, cursor)`, true for phases that may have more items than that, which
/// work-items run one after the other. Optional: `bool needs_barriers(plan)`, false if items wait for their inputs
/// themselves, which they may where `can_wait_for_data` (load.hpp); and `keep_barriers(plan)`, called where barriers
/// cost little, which makes it true. Or `Wait wait_before(plan, cursor)`, which chooses for each phase but the first.
template <class K>
concept PlannedPhaseKernel = KernelArguments<K> && std::is_trivially_default_constructible_v<typename K::Plan> &&
    std::is_trivially_copyable_v<typename K::Fetched> &&
    requires(const K& kernel, typename K::Plan& plan, const typename K::Plan& planned, std::uint32_t phase,
             const typename K::Cursor& cursor, std::uint32_t item, typename K::Fetched& fetched) {
  { K::plan_parts } -> std::convertible_to<std::uint32_t>;
  kernel.plan_part(plan, item);
  { kernel.phases(planned) } -> std::same_as<std::uint32_t>;
  { kernel.cursor_at(planned, phase) } -> std::same_as<typename K::Cursor>;
  { kernel.next(planned, cursor) } -> std::same_as<typename K::Cursor>;
  { kernel.items(planned, cursor) } -> std::same_as<std::uint32_t>;
  kernel.fetch(planned, cursor, item, fetched);
  kernel(planned, cursor, item, fetched);
};

template <class K>
concept PhaseKernel = SimplePhaseKernel<K> || PlannedPhaseKernel<K>;

/// A simple phase kernel as a planned one with nothing to plan or fetch.
template <SimplePhaseKernel K>
struct WithoutPlan {
  struct Plan {};
  struct Fetched {};
  using Cursor = std::uint32_t;
  static constexpr std::uint32_t plan_parts = 0;

  K kernel;

  FATHOM_HD void plan_part(Plan&, std::uint32_t) const {}
  FATHOM_HD std::uint32_t phases(const Plan&) const { return kernel.phases(); }
  FATHOM_HD Cursor cursor_at(const Plan&, std::uint32_t phase) const { return phase; }
  FATHOM_HD std::uint32_t items(const Plan&, Cursor phase) const { return kernel.items(phase); }
  FATHOM_HD Cursor next(const Plan&, Cursor phase) const { return phase + 1; }
  FATHOM_HD void fetch(const Plan&, Cursor, std::uint32_t, Fetched&) const {}
  FATHOM_HD void operator()(const Plan&, Cursor phase, std::uint32_t item, const Fetched&) const {
    kernel(phase, item);
  }
  FATHOM_HD void report_overrun() const {
    if constexpr (requires { kernel.report_overrun(); }) kernel.report_overrun();
  }
};

template <PhaseKernel K>
auto planned(const K& kernel) {
  if constexpr (PlannedPhaseKernel<K>)
    return kernel;
  else
    return WithoutPlan<K>{kernel};
}

/// Whether a phase without items is the last: declared by `static constexpr bool ends_at_empty_phase = true` in kernels
/// that do not know their number of phases beforehand.
template <class K>
constexpr bool ends_at_empty_phase() {
  if constexpr (requires { K::ends_at_empty_phase; }) {
    return K::ends_at_empty_phase;
  } else {
    return false;
  }
}

/// Whether a phase kernel usually has few items, whatever their maximum: `static constexpr bool has_few_items`.
template <class K>
constexpr bool has_few_items() {
  if constexpr (requires { K::has_few_items; }) {
    return K::has_few_items;
  } else {
    return false;
  }
}

/// Whether a phase kernel gains more from registers than from occupancy: `static constexpr bool wants_registers`.
template <class K>
constexpr bool wants_registers() {
  if constexpr (requires { K::wants_registers; }) {
    return K::wants_registers;
  } else {
    return false;
  }
}

/// Whether a team of work-items (math/team.hpp) runs an item of an item kernel, on GPUs whose back end has teams:
/// `static constexpr bool runs_in_teams`. In its call operator the team's leader writes, once all have read.
template <class K>
constexpr bool runs_in_teams() {
  if constexpr (requires { K::runs_in_teams; }) {
    return K::runs_in_teams;
  } else {
    return false;
  }
}

/// Work-items of a work-group of an item or phase kernel: the kernel's own `group_size`, or 128. Heavy kernels with few
/// items want small groups, to spread over all compute units.
template <class K>
constexpr std::uint32_t items_per_group() {
  if constexpr (requires { K::group_size; }) {
    return K::group_size;
  } else {
    return 128;
  }
}

/// An array in local memory of a type with default values, which a trivial `Local` may not contain directly.
template <class T, std::uint32_t Size>
class LocalArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  FATHOM_HD T& operator[](std::uint32_t i) { return reinterpret_cast<T*>(bytes_)[i]; }

 private:
  alignas(T) std::byte bytes_[Size * sizeof(T)];
};

/// Sets every item of an array.
template <class T>
struct Fill {
  T* to;
  T value;
  FATHOM_HD void operator()(std::uint32_t i) const { to[i] = value; }
};

}  // namespace fathom::exec
