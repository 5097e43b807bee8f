#include "exec/sycl/sycl_device.hpp"

#include <algorithm>
#include <exception>
#include <vector>

#include "exec/backends.hpp"

namespace fathom::exec {

namespace {

// CUDA's alignment. A CPU's allocations would be aligned to 16 bytes only, which code for wider types cannot use.
constexpr std::size_t alignment = 256;

/// A multiple of the alignment, as C's aligned_alloc requires.
std::size_t padded(std::size_t bytes) { return (bytes + alignment - 1) / alignment * alignment; }

/// GPUs first: `sycl` then selects one if there is any.
std::vector<sycl::device> all_devices() {
  adaptive_cpp::keep_runtime();
  std::vector<sycl::device> devices = sycl::device::get_devices();
  std::stable_partition(devices.begin(), devices.end(), [](const sycl::device& device) { return device.is_gpu(); });
  return devices;
}

DeviceInfo describe(const sycl::device& device, int index) {
  DeviceInfo info;
  info.backend = Backend::sycl;
  info.index = index;
  info.name = device.get_info<sycl::info::device::name>();
  info.memory = device.get_info<sycl::info::device::global_mem_size>();
  info.compute_units = device.get_info<sycl::info::device::max_compute_units>();
  info.is_gpu = device.is_gpu();
  // AdaptiveCpp reports the whole address space as a CPU's memory.
  if (!info.is_gpu) info.memory = std::min(info.memory, host_device_info().memory);
  info.available = device.has(sycl::aspect::usm_device_allocations);
  if (!info.available) info.why_not = "it has no unified shared memory";
  return info;
}

void throw_first(sycl::exception_list errors) {
  for (const std::exception_ptr& error : errors) std::rethrow_exception(error);
}

/// Event times come from the stream if there is one; otherwise each submission must be profiled.
sycl::property_list properties_for(const sycl::device& device) {
  if (adaptive_cpp::has_native_stream(device)) return {sycl::property::queue::in_order()};
  return {sycl::property::queue::in_order(), sycl::property::queue::enable_profiling()};
}

sycl::queue make_queue(int index, const Where& where) {
  try {
    const sycl::device device = all_devices()[static_cast<std::size_t>(index)];
    return sycl::queue(device, throw_first, properties_for(device));
  } catch (const sycl::exception& error) {
    throw DeviceError(ErrorCode::unavailable, std::string("creating a queue: ") + error.what(), 0, where);
  }
}

}  // namespace

std::vector<DeviceInfo> sycl_device_infos() {
  std::vector<DeviceInfo> all;
  DeviceInfo none;
  none.backend = Backend::sycl;
  none.why_not = "SYCL found no device";
  try {
    for (const sycl::device& device : all_devices()) all.push_back(describe(device, static_cast<int>(all.size())));
  } catch (const sycl::exception& error) {
    none.why_not = error.what();
  }
  if (all.empty()) all.push_back(none);
  return all;
}

SyclDevice::SyclDevice(int index, Where where)
    : info_(select_device("sycl:" + std::to_string(index), sycl_device_infos())),
      queue_(make_queue(index, where)),
      stream_(adaptive_cpp::native_stream(queue_)) {
  if (!adaptive_cpp::may_groups_wait(queue_.get_device())) return;
  grid_barrier_ = static_cast<std::uint32_t*>(do_allocate(sizeof(std::uint32_t), where));
  submit_zero(grid_barrier_, sizeof(std::uint32_t), where);
}

SyclDevice::~SyclDevice() {
  try {
    queue_.wait_and_throw();
    if (grid_barrier_) sycl::free(grid_barrier_, queue_);
  } catch (const sycl::exception&) {  // nobody is left to report it to
  }
}

void SyclDevice::launch(Graph& graph, Where where) {
  traffic_ += graph.traffic_;
  if (stream_)
    graph.nodes_.launch(stream_, where);
  else
    ClosureQueue::launch(graph.closures_, where);
}

sycl::event SyclDevice::Event::get() const {
  const std::lock_guard lock(mutex_);
  return event_;
}

void SyclDevice::Event::set(const sycl::event& event) {
  const std::lock_guard lock(mutex_);
  event_ = event;
}

bool SyclDevice::Event::is_done() const {
  if (native_) return native_->is_done();
  return get().get_info<sycl::info::event::command_execution_status>() == sycl::info::event_command_status::complete;
}

void SyclDevice::Event::wait() const {
  if (native_) return native_->wait();
  get().wait();
}

double SyclDevice::Event::milliseconds_since(const Event& begin) const {
  if (native_) return native_->milliseconds_since(*begin.native_);
  const auto end_of = [](const Event& event) {
    return event.get().get_profiling_info<sycl::info::event_profiling::command_end>();
  };
  try {
    return (static_cast<double>(end_of(*this)) - static_cast<double>(end_of(begin))) * 1e-6;
  } catch (const sycl::exception& error) {
    throw DeviceError(ErrorCode::invalid_argument, std::string("timing: ") + error.what(), 0, Where::current());
  }
}

void SyclDevice::mark(Event& event, Where where) {
  if (stream_) return event.native_->mark(stream_, is_recording(), where);
  submit([this, &event, where] {
    checked("marking an event", where, [&] { event.set(queue_.single_task([] {})); });
    adaptive_cpp::flush();
  });
}

void SyclDevice::wait(Where where) {
  checked("waiting for the device", where, [this] { queue_.wait(); });
}

void* SyclDevice::do_allocate(std::size_t bytes, const Where& where) {
  // A CPU's driver may grant more than exists.
  const bool fits = bytes_in_use() <= info_.memory && bytes <= info_.memory - bytes_in_use();
  void* const memory = fits ? checked(
                                  "allocating device memory", where,
                                  [&] { return sycl::aligned_alloc_device(alignment, padded(bytes), queue_); }, bytes)
                            : nullptr;
  if (!memory) throw DeviceError(ErrorCode::capacity, "out of device memory", bytes, where);
  return memory;
}

void* SyclDevice::do_allocate_pinned(std::size_t bytes, const Where& where) {
  const std::size_t most = host_device_info().memory;
  void* const memory = bytes <= most
                           ? checked(
                                 "allocating pinned memory", where,
                                 [&] { return sycl::aligned_alloc_host(alignment, padded(bytes), queue_); }, bytes)
                           : nullptr;
  if (!memory) throw DeviceError(ErrorCode::capacity, "out of pinned memory", bytes, where);
  return memory;
}

void SyclDevice::do_release(void* memory) noexcept {
  queue_.wait();
  sycl::free(memory, queue_);
}

void SyclDevice::release_pinned(void* memory) noexcept { do_release(memory); }

void SyclDevice::copy_bytes(void* to, const void* from, std::size_t bytes, const Where& where) {
  if (bytes == 0) return;
  submit([this, to, from, bytes, where] {
    checked(
        "copying", where,
        [&] { queue_.submit(no_event_, [=](sycl::handler& handler) { handler.memcpy(to, from, bytes); }); }, bytes);
  });
}

void SyclDevice::submit_zero(void* to, std::size_t bytes, const Where& where) {
  if (bytes == 0) return;
  submit([this, to, bytes, where] {
    checked(
        "zeroing", where,
        [&] { queue_.submit(no_event_, [=](sycl::handler& handler) { handler.memset(to, 0, bytes); }); }, bytes);
  });
}

}  // namespace fathom::exec
