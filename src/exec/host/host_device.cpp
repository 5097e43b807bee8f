#include "exec/host/host_device.hpp"

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#if defined(__unix__) || defined(__APPLE__)
#include <unistd.h>
#endif

#include "exec/backends.hpp"
#include "exec/host/primitives.hpp"

namespace fathom::exec {

namespace {

// A cache line, and the widest vector.
constexpr std::size_t alignment = 64;

/// Aligned by hand: glibc before 2.38 does not reuse the gaps that it leaves for alignment (its bug 14581), so memory
/// allocated and released in every step would grow forever.
void* allocate_aligned(std::size_t bytes) {
  const std::size_t room = alignment + sizeof(void*);
  void* const raw = bytes > SIZE_MAX - room ? nullptr : std::malloc(bytes + room);
  if (!raw) return nullptr;
  void* aligned = static_cast<std::byte*>(raw) + sizeof(void*);
  std::size_t left = bytes + alignment;
  std::align(alignment, bytes, aligned, left);
  static_cast<void**>(aligned)[-1] = raw;
  return aligned;
}
void release_aligned(void* memory) {
  if (memory) std::free(static_cast<void**>(memory)[-1]);
}

int machine_threads() {
  const unsigned threads = std::thread::hardware_concurrency();
  return threads == 0 ? 1 : static_cast<int>(threads);
}

std::string processor_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != line.npos) return line.substr(colon + 2);
  }
  return "processor";
}

std::size_t physical_memory() {
#if defined(_SC_PHYS_PAGES)
  return static_cast<std::size_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::size_t>(sysconf(_SC_PAGE_SIZE));
#else
  return 0;
#endif
}

}  // namespace

DeviceInfo host_device_info() {
  DeviceInfo info;
  info.backend = Backend::host;
  info.name = processor_name();
  info.memory = physical_memory();
  info.compute_units = static_cast<std::uint32_t>(machine_threads());
  info.available = true;
  return info;
}

HostDevice::HostDevice(int threads) : info_(host_device_info()), pool_(threads > 0 ? threads : machine_threads()) {}

double HostDevice::Event::milliseconds_since(const Event& begin) const {
  return static_cast<double>(nanoseconds_.load() - begin.nanoseconds_.load()) * 1e-6;
}

void HostDevice::mark(Event& event, Where) {
  submit([&event] {
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    event.nanoseconds_.store(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
    event.is_done_ = !host_faults.late;
  });
}

void* HostDevice::do_allocate(std::size_t bytes, const Where& where) {
  // An operating system that overcommits would grant this now and kill the process when the memory is touched.
  check_alive(where);
  const std::size_t free_bytes = info_.memory > bytes_in_use() ? info_.memory - bytes_in_use() : 0;
  void* const memory =
      allocation_fails() || (info_.memory != 0 && bytes > free_bytes) ? nullptr : allocate_aligned(bytes);
  if (!memory) {
    throw DeviceError(
        ErrorCode::capacity,
        "out of host memory: " + bytes_text(bytes_in_use()) + " of " + bytes_text(info_.memory) + " in use", bytes,
        where);
  }
  return memory;
}

void HostDevice::do_release(void* memory) noexcept { release_aligned(memory); }

void* HostDevice::do_allocate_pinned(std::size_t bytes, const Where& where) { return do_allocate(bytes, where); }

void HostDevice::release_pinned(void* memory) noexcept { do_release(memory); }

void HostDevice::submit_copy(void* to, const void* from, std::size_t bytes) {
  if (bytes == 0) return;
  submit([this, to, from, bytes] {
    for_each_chunk(bytes, 1 << 18, [to, from](std::size_t begin, std::size_t end) {
      std::memcpy(static_cast<std::byte*>(to) + begin, static_cast<const std::byte*>(from) + begin, end - begin);
    });
  });
}

void HostDevice::submit_zero(void* to, std::size_t bytes) {
  if (bytes == 0) return;
  submit([this, to, bytes] {
    for_each_chunk(bytes, 1 << 18, [to](std::size_t begin, std::size_t end) {
      std::memset(static_cast<std::byte*>(to) + begin, 0, end - begin);
    });
  });
}

template <class Key>
void HostDevice::sort_by_key(Scratch& scratch, Range range, Key* keys, std::uint32_t* values, int key_bits,
                             Where where) {
  check_items(range.capacity, where);
  std::byte* const memory = scratch.take(sort_scratch_bytes<Key>(range.capacity), where);
  launch_step([this, memory, range, keys, values, key_bits] {
    host::radix_sort(pool_, host::SortScratch<Key>(memory, range.capacity), range.size(), keys, values, key_bits);
  });
}
template void HostDevice::sort_by_key(Scratch&, Range, std::uint32_t*, std::uint32_t*, int, Where);
template void HostDevice::sort_by_key(Scratch&, Range, std::uint64_t*, std::uint32_t*, int, Where);

template <class Key>
std::size_t HostDevice::sort_scratch_bytes(std::uint32_t capacity) const {
  return host::SortScratch<Key>(nullptr, capacity).bytes;
}
template std::size_t HostDevice::sort_scratch_bytes<std::uint32_t>(std::uint32_t) const;
template std::size_t HostDevice::sort_scratch_bytes<std::uint64_t>(std::uint32_t) const;

void HostDevice::exclusive_scan(Scratch& scratch, Range range, const std::uint32_t* in, std::uint32_t* out,
                                std::uint32_t* total, Where where) {
  check_items(range.capacity, where);
  auto* const sums = reinterpret_cast<std::uint32_t*>(scratch.take(scan_scratch_bytes(range.capacity), where));
  launch_step([this, sums, range, in, out, total] {
    const std::uint32_t sum = host::exclusive_scan(pool_, sums, range.size(), in, out);
    if (total) *total = sum;
  });
}

void HostDevice::select(Scratch& scratch, Range range, const std::uint32_t* flags, std::uint32_t* indices,
                        std::uint32_t* count, Where where) {
  check_items(range.capacity, where);
  auto* const sums = reinterpret_cast<std::uint32_t*>(scratch.take(select_scratch_bytes(range.capacity), where));
  launch_step(
      [this, sums, range, flags, indices, count] { *count = host::select(pool_, sums, range.size(), flags, indices); });
}

std::size_t HostDevice::scan_scratch_bytes(std::uint32_t capacity) const {
  return host::chunk_count(capacity) * sizeof(std::uint32_t);
}

}  // namespace fathom::exec
