// What is asked of AdaptiveCpp beyond SYCL 2020.
#pragma once

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
