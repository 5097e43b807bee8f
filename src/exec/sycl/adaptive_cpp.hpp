// What is asked of AdaptiveCpp beyond SYCL 2020.
#pragma once

#include <cstdint>
#include <sycl/sycl.hpp>

#include "exec/cuda/stream.hpp"

namespace fathom::exec::adaptive_cpp {

/// Keeps the runtime alive to the program's end. Otherwise it goes with the last SYCL object, and the next one loads
/// all back ends anew.
inline void keep_runtime() {
  [[maybe_unused]] static const auto* const token = new hipsycl::rt::runtime_keep_alive_token;
}

/// Starts what a queue only gathered so far: on processors it gathers submissions to order them as a graph of tasks.
inline void flush() { hipsycl::rt::runtime_keep_alive_token().get()->dag().flush_async(); }

/// For submissions whose events nobody asks: it saves marking each in the queue.
inline sycl::property_list without_event() {
  return {sycl::property::command_group::AdaptiveCpp_coarse_grained_events()};
}

/// Whether work-groups that are resident together may wait for each other.
inline bool may_groups_wait(const sycl::device& device) { return device.get_backend() == sycl::backend::cuda; }

/// Makes what a work-group wrote before its last barrier visible to the whole device, as sycl::atomic_fence would,
/// which AdaptiveCpp lacks; a sub-group's barrier comes with a fence of the scope that it is told. To be called by all
/// items.
inline void device_fence_of_first_sub_group(const sycl::nd_item<1>& work_item) {
  const sycl::sub_group sub_group = work_item.get_sub_group();
  if (sub_group.get_group_linear_id() == 0) sycl::group_barrier(sub_group, sycl::memory_scope::device);
}

/// Loads a word that other groups change, and what they wrote before. On NVIDIA GPUs this scope and order make a load
/// that is one; AdaptiveCpp's others are plain loads, which the compiler takes out of loops.
inline std::uint32_t load_acquire(std::uint32_t& word) {
  return sycl::atomic_ref<std::uint32_t, sycl::memory_order::acq_rel, sycl::memory_scope::system>(word).load(
      sycl::memory_order::acquire, sycl::memory_scope::system);
}

/// Whether an in-order queue of the device is a CUDA stream that can be used as one.
inline bool has_native_stream(const sycl::device& device) {
  return device.get_backend() == sycl::backend::cuda && cuda::has_streams();
}

/// The stream that an in-order queue has on an NVIDIA GPU; null elsewhere.
inline cuda::Stream native_stream(const sycl::queue& queue) {
  const auto* const executor = queue.AdaptiveCpp_inorder_executor();
  return executor && has_native_stream(queue.get_device())
             ? static_cast<cuda::Stream>(executor->get_queue()->get_native_type())
             : nullptr;
}

/// The number by which CUDA knows the device.
inline int native_index(const sycl::queue& queue) {
  return queue.AdaptiveCpp_inorder_executor()->get_queue()->get_device().get_id();
}

}  // namespace fathom::exec::adaptive_cpp
