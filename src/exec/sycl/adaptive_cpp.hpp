// Features of AdaptiveCpp beyond SYCL 2020.
#pragma once

#include <cstdint>
#include <sycl/sycl.hpp>

#include "exec/cuda/stream.hpp"

namespace fathom::exec::adaptive_cpp {

/// Keeps the runtime alive until the program ends. Otherwise it is unloaded with the last SYCL object, and the next one
/// loads all back ends again.
inline void keep_runtime() {
  [[maybe_unused]] static const auto* const token = new hipsycl::rt::runtime_keep_alive_token;
}

/// Starts submissions that a queue has only collected: on CPUs it collects them to order them as a task graph.
inline void flush() { hipsycl::rt::runtime_keep_alive_token().get()->dag().flush_async(); }

/// For submissions whose events are never queried: saves marking each one in the queue.
inline sycl::property_list without_event() {
  return {sycl::property::command_group::AdaptiveCpp_coarse_grained_events()};
}

/// Whether work-groups that are resident together may wait for each other.
inline bool may_groups_wait(const sycl::device& device) { return device.get_backend() == sycl::backend::cuda; }

/// Makes a work-group's writes before its last barrier visible to the whole device, like sycl::atomic_fence, which
/// AdaptiveCpp lacks; a sub-group's barrier includes a fence of the given scope. All items must call it.
inline void device_fence_of_first_sub_group(const sycl::nd_item<1>& work_item) {
  const sycl::sub_group sub_group = work_item.get_sub_group();
  if (sub_group.get_group_linear_id() == 0) sycl::group_barrier(sub_group, sycl::memory_scope::device);
}

/// Loads a word that other groups change, and makes their earlier writes visible. On NVIDIA GPUs only this scope and
/// order give an acquire load; AdaptiveCpp's others are plain loads, which the compiler hoists out of loops.
inline std::uint32_t load_acquire(std::uint32_t& word) {
  return sycl::atomic_ref<std::uint32_t, sycl::memory_order::acq_rel, sycl::memory_scope::system>(word).load(
      sycl::memory_order::acquire, sycl::memory_scope::system);
}

/// Whether the device's in-order queue is a usable CUDA stream.
inline bool has_native_stream(const sycl::device& device) {
  return device.get_backend() == sycl::backend::cuda && cuda::has_streams();
}

/// The stream behind an in-order queue on an NVIDIA GPU; null elsewhere.
inline cuda::Stream native_stream(const sycl::queue& queue) {
  const auto* const executor = queue.AdaptiveCpp_inorder_executor();
  return executor && has_native_stream(queue.get_device())
             ? static_cast<cuda::Stream>(executor->get_queue()->get_native_type())
             : nullptr;
}

/// CUDA's number of the device.
inline int native_index(const sycl::queue& queue) {
  return queue.AdaptiveCpp_inorder_executor()->get_queue()->get_device().get_id();
}

}  // namespace fathom::exec::adaptive_cpp
