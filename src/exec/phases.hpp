// Running the phases of a planned kernel, for back ends where all work-items run one kernel and wait for each other.
#pragma once

#include <cstdint>

#include "exec/kernel.hpp"

namespace fathom::exec {

/// All phases, once the plan is made, as work-item `first` of `stride` sees them. `wait_for_all(meanwhile)` returns
/// when every work-item has called it, and calls `meanwhile` between arriving there and leaving: that is when the loads
/// of the next phase are made.
#if defined(__CUDACC__)
#pragma nv_exec_check_disable  // a barrier exists on the device alone, and so do the callers
#endif
template <bool ends_at_empty, class Kernel, class WaitForAll>
FATHOM_HD void run_planned(std::uint32_t first, std::uint32_t stride, std::uint32_t most_phases,
                           std::uint32_t most_items, const Kernel& kernel, const typename Kernel::Plan& plan,
                           const WaitForAll& wait_for_all) {
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
    for (std::uint32_t i = first; i < n; i += stride) {
      if (i != first) fetched = kernel.fetch(plan, place, i);
      kernel(plan, place, i, fetched);
    }
    if (phase + 1 == phases) return;
    wait_for_all([&] {
      place = kernel.place(plan, phase + 1);
      if constexpr (Kernel::plan_parts > 0) {
        n = items_of(place);
        if (first < n) fetched = kernel.fetch(plan, place, first);
      }
    });
    // How many items a phase without a plan has may be what the phase before has counted.
    if constexpr (Kernel::plan_parts == 0) n = items_of(place);
  }
}

}  // namespace fathom::exec
