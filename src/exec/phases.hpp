// Runs the phases of a planned kernel, for back ends where all work-items run one kernel and wait for each other.
#pragma once

#include <cstdint>

#include "check/check.hpp"
#include "exec/kernel.hpp"

namespace fathom::exec {

/// Limits phases and items of a phase to those launched for. More are an error, which the kernel reports if it can
/// (`report_overrun()`); the excess is not run.
template <class Kernel>
FATHOM_HD std::uint32_t within(const Kernel& kernel, std::uint32_t wanted, std::uint32_t most) {
  FATHOM_ASSERT(wanted <= most);
  if (wanted <= most) return wanted;
  if constexpr (requires { kernel.report_overrun(); }) kernel.report_overrun();
  return most;
}

/// One work-item's items of a phase: `first`, `first + stride` … below `end`.
struct ItemShare {
  std::uint32_t first, stride, end;
};

template <class Kernel>
FATHOM_HD ItemShare share_of(const Kernel& kernel, const typename Kernel::Plan& plan,
                             const typename Kernel::Cursor& cursor, std::uint32_t first, std::uint32_t stride,
                             std::uint32_t max_phase_items) {
  const std::uint32_t n = kernel.items(plan, cursor);
  if constexpr (requires { kernel.may_exceed_launch(plan, cursor); })
    if (kernel.may_exceed_launch(plan, cursor)) return {first, stride, n};
  return {first, stride, within(kernel, n, max_phase_items)};
}

/// Runs a work-item's items of a phase without prefetching.
template <class Kernel>
FATHOM_HD void run_share(const Kernel& kernel, const typename Kernel::Plan& plan, const typename Kernel::Cursor& cursor,
                         const ItemShare& share) {
  for (std::uint32_t i = share.first; i < share.end; i += share.stride) {
    typename Kernel::Fetched fetched;
    kernel.fetch(plan, cursor, i, fetched);
    kernel(plan, cursor, i, fetched);
  }
}

/// All phases, after planning, from the view of work-item `first` of `stride`. Between two phases each calls
/// `barrier.arrive()`, loads what it may, and calls `barrier.wait()`, which returns when every work-item has arrived;
/// if the kernel says that items wait for their inputs themselves, or for their warp, it calls `barrier.pass()` or
/// `barrier.wait_for_warp()` instead.
#if defined(__CUDACC__)
#pragma nv_exec_check_disable  // barriers exist only on the device, and so do the callers
#endif
template <bool ends_at_empty, class Kernel, class Barrier>
FATHOM_HD void run_planned(std::uint32_t first, std::uint32_t stride, std::uint32_t max_phases,
                           std::uint32_t max_phase_items, const Kernel& kernel, const typename Kernel::Plan& plan,
                           Barrier& barrier) {
  const std::uint32_t phases = within(kernel, kernel.phases(plan), max_phases);
  if (phases == 0) return;
  // Without a plan, the number of a phase's items may have been counted by the phase before.
  constexpr bool is_planned = Kernel::plan_parts > 0;
  Wait wait = Wait::for_all;
  if constexpr (requires { kernel.needs_barriers(plan); })
    if (!kernel.needs_barriers(plan)) wait = Wait::for_data;
  auto cursor = kernel.cursor_at(plan, 0);
  ItemShare share = share_of(kernel, plan, cursor, first, stride, max_phase_items);
  std::uint32_t i = share.first;
  const auto go_on = [&] {
    cursor = kernel.next(plan, cursor);
    share = share_of(kernel, plan, cursor, first, stride, max_phase_items);
    i = share.first;
  };
  constexpr bool waits_for_each = requires { kernel.wait_before(plan, cursor); };
  bool begins = false;
  // A single call of `fetch` and of the kernel, in one loop over items and phases: their code is long, and each copy
  // would have to be fetched again. Also, where two loads merge, a register may have to be copied, which waits for its
  // load.
  for (std::uint32_t phase = 0;;) {
    if (ends_at_empty && share.end == 0) return;
    typename Kernel::Fetched fetched;
    if (i < share.end) kernel.fetch(plan, cursor, i, fetched);
    if (begins) {
      begins = false;
      if (wait == Wait::for_all)
        barrier.wait();
      else if (wait == Wait::for_data)
        barrier.pass();
      else
        barrier.wait_for_warp();
      if constexpr (!is_planned) {
        go_on();
        if (ends_at_empty && share.end == 0) return;
      }
    }
    if (i < share.end) {
      kernel(plan, cursor, i, fetched);
      if (share.end - i > share.stride) {
        i += share.stride;
        continue;
      }
    }
    if (++phase == phases) return;
    begins = true;
    if constexpr (waits_for_each) {
      go_on();
      wait = kernel.wait_before(plan, cursor);
    }
    if (wait == Wait::for_all) barrier.arrive();
    if constexpr (is_planned && !waits_for_each) go_on();
  }
}

}  // namespace fathom::exec
