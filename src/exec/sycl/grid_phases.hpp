// Phases in one launch, on GPUs whose work-groups may wait for each other.
//
// SYCL guarantees no progress to work-groups that wait for each other. NVIDIA GPUs run a resident group until it ends,
// so groups may wait if all of them are resident: at most one per compute unit.
#pragma once

#include <cstdint>
#include <sycl/sycl.hpp>

#include "exec/kernel.hpp"
#include "exec/phases.hpp"
#include "exec/sycl/adaptive_cpp.hpp"

namespace fathom::exec {

/// Maximum groups of a phase kernel with few items: fewer groups pass the barrier sooner.
inline constexpr std::uint32_t max_groups_with_few_items = 16;

/// Minimum items per group of a phase kernel while compute units suffice: two warps.
inline constexpr std::uint32_t items_of_resident_group = 64;

/// A barrier of all work-groups of a launch, after CUDA's cooperative groups. All groups together add 2³¹ to the word,
/// so its highest bit flips when the last one arrives and the others are unchanged: nothing needs a reset, the next
/// launch may have a different number of groups, and no group waits for the result of an addition. The word starts at
/// 0.
class GridBarrier {
 public:
  GridBarrier(const sycl::nd_item<1>& work_item, std::uint32_t* word)
      : work_item_(work_item), word_(word), turned_(~adaptive_cpp::load_acquire(*word) & turning_bit) {}

  /// Does nothing: `wait` does everything. Only loads may come between the two.
  void arrive() {}
  void pass() {}
  void wait_for_warp() { sycl::group_barrier(work_item_.get_group()); }

  void wait() {
    const auto group = work_item_.get_group();
    const auto groups = static_cast<std::uint32_t>(work_item_.get_group_range(0));
    sycl::group_barrier(group);
    if (groups == 1) return;
    const bool is_first = work_item_.get_local_linear_id() == 0;
    // AdaptiveCpp's read-modify-writes are relaxed, whatever order they are given; this makes the group's writes
    // visible first.
    adaptive_cpp::device_fence_of_first_sub_group(work_item_);
    if (is_first) {
      const std::uint32_t share = group.get_group_linear_id() == 0 ? turning_bit - (groups - 1) : 1;
      sycl::atomic_ref<std::uint32_t, sycl::memory_order::relaxed, sycl::memory_scope::device>(*word_).fetch_add(share);
      while ((adaptive_cpp::load_acquire(*word_) & turning_bit) != turned_) {
      }
    }
    turned_ ^= turning_bit;
    sycl::group_barrier(group);
  }

 private:
  static constexpr std::uint32_t turning_bit = 0x8000'0000u;

  sycl::nd_item<1> work_item_;
  std::uint32_t* word_;
  std::uint32_t turned_;  ///< value of the highest bit once all have arrived
};

/// All phases of a planned kernel; each group keeps its own plan.
template <bool ends_at_empty, class Kernel>
void run_phases(const sycl::nd_item<1>& work_item, std::uint32_t* barrier_word, std::uint32_t max_phases,
                std::uint32_t max_phase_items, const Kernel& kernel, typename Kernel::Plan& plan_of_group) {
  GridBarrier barrier(work_item, barrier_word);
  const auto stride = static_cast<std::uint32_t>(work_item.get_global_range(0));
  // Warps are interleaved over the groups: a phase of few items then uses as many compute units as it has warps.
  constexpr std::uint32_t warp_size = 32;
  const auto local = static_cast<std::uint32_t>(work_item.get_local_linear_id());
  const auto groups = static_cast<std::uint32_t>(work_item.get_group_range(0));
  const auto group = static_cast<std::uint32_t>(work_item.get_group_linear_id());
  const std::uint32_t first = (local / warp_size * groups + group) * warp_size + local % warp_size;
  if constexpr (Kernel::plan_parts > 0) {
    const auto size = static_cast<std::uint32_t>(work_item.get_local_range(0));
    for (std::uint32_t k = local; k < Kernel::plan_parts; k += size) kernel.plan_part(plan_of_group, k);
    sycl::group_barrier(work_item.get_group());
  }
  run_planned<ends_at_empty>(first, stride, max_phases, max_phase_items, kernel, plan_of_group, barrier);
}

}  // namespace fathom::exec
