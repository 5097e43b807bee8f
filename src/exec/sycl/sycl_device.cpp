#include "exec/sycl/sycl_device.hpp"

#include <algorithm>
#include <exception>
#include <vector>

#include "exec/backends.hpp"

namespace fathom::exec {

namespace {

/// GPUs first, so that `sycl` means one where there is one.
std::vector<sycl::device> all_devices() {
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
  info.available = device.has(sycl::aspect::usm_device_allocations);
  if (!info.available) info.why_not = "it has no unified shared memory";
  return info;
}

void throw_first(sycl::exception_list errors) {
  for (const std::exception_ptr& error : errors) std::rethrow_exception(error);
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
      queue_(checked("creating a queue", where, [&] {
        return sycl::queue(all_devices()[static_cast<std::size_t>(index)], throw_first,
                           {sycl::property::queue::in_order(), sycl::property::queue::enable_profiling()});
      })) {}

SyclDevice::~SyclDevice() { queue_.wait(); }

sycl::event SyclDevice::Event::get() const {
  const std::lock_guard lock(mutex_);
  return event_;
}

void SyclDevice::Event::set(const sycl::event& event) {
  const std::lock_guard lock(mutex_);
  event_ = event;
}

bool SyclDevice::Event::is_done() const {
  return checked("asking for an event", Where::current(), [this] {
    return get().get_info<sycl::info::event::command_execution_status>() == sycl::info::event_command_status::complete;
  });
}

void SyclDevice::Event::wait() const {
  checked("waiting for an event", Where::current(), [this] { get().wait(); });
}

double SyclDevice::Event::milliseconds_since(const Event& begin) const {
  return checked("timing", Where::current(), [&] {
    const auto end_of = [](const Event& event) {
      return event.get().get_profiling_info<sycl::info::event_profiling::command_end>();
    };
    return (static_cast<double>(end_of(*this)) - static_cast<double>(end_of(begin))) * 1e-6;
  });
}

void SyclDevice::mark(Event& event, Where where) {
  submit([this, &event, where] { checked("marking an event", where, [&] { event.set(queue_.single_task([] {})); }); });
}

void SyclDevice::wait(Where where) {
  checked("waiting for the device", where, [this] { queue_.wait_and_throw(); });
}

void* SyclDevice::do_allocate(std::size_t bytes, const Where& where) {
  // A CPU's driver may grant more than there is.
  const bool fits = bytes_in_use() <= info_.memory && bytes <= info_.memory - bytes_in_use();
  void* const memory =
      fits ? checked(
                 "allocating device memory", where, [&] { return sycl::malloc_device(bytes, queue_); }, bytes)
           : nullptr;
  if (!memory) throw DeviceError(ErrorCode::capacity, "out of device memory", bytes, where);
  return memory;
}

void* SyclDevice::do_allocate_pinned(std::size_t bytes, const Where& where) {
  const std::size_t most = host_device_info().memory;
  void* const memory =
      bytes <= most ? checked(
                          "allocating pinned memory", where, [&] { return sycl::malloc_host(bytes, queue_); }, bytes)
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
        "copying", where, [&] { queue_.memcpy(to, from, bytes); }, bytes);
  });
}

void SyclDevice::submit_zero(void* to, std::size_t bytes, const Where& where) {
  if (bytes == 0) return;
  submit([this, to, bytes, where] {
    checked(
        "zeroing", where, [&] { queue_.memset(to, 0, bytes); }, bytes);
  });
}

}  // namespace fathom::exec
