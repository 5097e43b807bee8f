// Sort, scan and selection on CUDA, by CUB. The working memory comes from the caller's scratch, so graphs can record
// all of it.
#include <thrust/iterator/counting_iterator.h>
#include <thrust/iterator/tabulate_output_iterator.h>
#include <thrust/iterator/transform_iterator.h>

#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <cub/device/device_select.cuh>

#include "exec/cuda/cuda_device.cuh"

namespace fathom::exec {

namespace {

/// CUB takes the number of items from the host, so a sort whose count is on the device sorts the whole capacity. The
/// sort is stable: the padding stays behind real keys of all ones.
template <class Key>
struct PadWithOnes {
  Range range;
  Key* keys;
  FATHOM_HD void operator()(std::uint32_t i) const {
    if (i >= range.size()) keys[i] = ~Key{0};
  }
};

template <class Key>
struct MoveBack {
  const Key* from_keys;
  const std::uint32_t* from_values;
  Key* keys;
  std::uint32_t* values;
  FATHOM_HD void operator()(std::uint32_t i) const {
    keys[i] = from_keys[i];
    values[i] = from_values[i];
  }
};

/// Items beyond the count contribute zero.
struct TermOf {
  Range range;
  const std::uint32_t* in;
  __device__ std::uint32_t operator()(std::uint32_t i) const { return i < range.size() ? in[i] : 0; }
};

/// The sum before the item after the last is the total.
struct StoreSum {
  Range range;
  std::uint32_t* out;
  std::uint32_t* total;
  __device__ void operator()(std::uint32_t i, std::uint32_t sum) const {
    if (i < range.size()) out[i] = sum;
    if (i == range.capacity && total) *total = sum;
  }
};

struct IsFlagged {
  Range range;
  const std::uint32_t* flags;
  __device__ bool operator()(std::uint32_t i) const { return i < range.size() && flags[i] != 0; }
};

/// With null memory only writes the required size to `bytes`.
template <class Key>
cudaError_t sort(void* memory, std::size_t& bytes, cub::DoubleBuffer<Key>& keys,
                 cub::DoubleBuffer<std::uint32_t>& values, std::uint32_t n, int key_bits, cudaStream_t stream) {
  return cub::DeviceRadixSort::SortPairs(memory, bytes, keys, values, n, 0, key_bits, stream);
}

cudaError_t scan(void* memory, std::size_t& bytes, Range range, const std::uint32_t* in, std::uint32_t* out,
                 std::uint32_t* total, cudaStream_t stream) {
  const auto terms = thrust::make_transform_iterator(thrust::counting_iterator<std::uint32_t>(0), TermOf{range, in});
  const auto sums = thrust::make_tabulate_output_iterator(StoreSum{range, out, total});
  return cub::DeviceScan::ExclusiveScan(memory, bytes, terms, sums, ::cuda::std::plus<std::uint32_t>{},
                                        std::uint32_t{0}, range.capacity + 1, stream);
}

cudaError_t select_if(void* memory, std::size_t& bytes, Range range, const std::uint32_t* flags, std::uint32_t* indices,
                      std::uint32_t* count, cudaStream_t stream) {
  return cub::DeviceSelect::If(memory, bytes, thrust::counting_iterator<std::uint32_t>(0), indices, count,
                               range.capacity, IsFlagged{range, flags}, stream);
}

/// The second half of the double buffers, and CUB's own working memory.
template <class Key>
struct SortScratch {
  Key* keys;
  std::uint32_t* values;
  std::byte* working;
  std::size_t working_bytes = 0;
  std::size_t bytes;

  SortScratch(std::byte* memory, std::uint32_t capacity, const Where& where) {
    cub::DoubleBuffer<Key> no_keys;
    cub::DoubleBuffer<std::uint32_t> no_values;
    cuda::check(sort(nullptr, working_bytes, no_keys, no_values, capacity, 8 * sizeof(Key), nullptr), "sizing a sort",
                where);
    ScratchCutter cutter(memory);
    keys = cutter.cut<Key>(capacity);
    values = cutter.cut<std::uint32_t>(capacity);
    working = cutter.cut<std::byte>(working_bytes);
    bytes = cutter.used();
  }
};

}  // namespace

template <class Key>
void CudaDevice::sort_by_key(Scratch& scratch, Range range, Key* keys, std::uint32_t* values, int key_bits,
                             Where where) {
  check_items(range.capacity, where);
  const std::uint32_t capacity = range.capacity;
  const SortScratch<Key> half(scratch.take(sort_scratch_bytes<Key>(capacity), where), capacity, where);
  if (capacity == 0) return;
  const std::uint64_t launches = traffic_.launches;
  if (range.count) parallel_for(capacity, PadWithOnes<Key>{range, keys}, where);
  cub::DoubleBuffer<Key> both_keys(keys, half.keys);
  cub::DoubleBuffer<std::uint32_t> both_values(values, half.values);
  std::size_t bytes = half.working_bytes;
  bind();
  cuda::check(sort(half.working, bytes, both_keys, both_values, capacity, key_bits, stream_), "sorting", where);
  if (both_keys.Current() != keys) {
    parallel_for(capacity, MoveBack<Key>{both_keys.Current(), both_values.Current(), keys, values}, where);
  }
  traffic_.launches = launches + 1;
}
template void CudaDevice::sort_by_key(Scratch&, Range, std::uint32_t*, std::uint32_t*, int, Where);
template void CudaDevice::sort_by_key(Scratch&, Range, std::uint64_t*, std::uint32_t*, int, Where);

template <class Key>
std::size_t CudaDevice::sort_scratch_bytes(std::uint32_t capacity) const {
  bind();
  return SortScratch<Key>(nullptr, capacity, Where::current()).bytes;
}
template std::size_t CudaDevice::sort_scratch_bytes<std::uint32_t>(std::uint32_t) const;
template std::size_t CudaDevice::sort_scratch_bytes<std::uint64_t>(std::uint32_t) const;

void CudaDevice::exclusive_scan(Scratch& scratch, Range range, const std::uint32_t* in, std::uint32_t* out,
                                std::uint32_t* total, Where where) {
  check_items(range.capacity, where);
  std::size_t bytes = scan_scratch_bytes(range.capacity);
  void* const memory = scratch.take(bytes, where);
  start_launch();
  cuda::check(scan(memory, bytes, range, in, out, total, stream_), "scanning", where);
}

std::size_t CudaDevice::scan_scratch_bytes(std::uint32_t capacity) const {
  bind();
  std::size_t bytes = 0;
  cuda::check(scan(nullptr, bytes, capacity, nullptr, nullptr, nullptr, nullptr), "sizing a scan", Where::current());
  return bytes;
}

void CudaDevice::select(Scratch& scratch, Range range, const std::uint32_t* flags, std::uint32_t* indices,
                        std::uint32_t* count, Where where) {
  check_items(range.capacity, where);
  if (range.capacity == 0) return zero(count, 1, where);
  std::size_t bytes = select_scratch_bytes(range.capacity);
  void* const memory = scratch.take(bytes, where);
  start_launch();
  cuda::check(select_if(memory, bytes, range, flags, indices, count, stream_), "selecting", where);
}

std::size_t CudaDevice::select_scratch_bytes(std::uint32_t capacity) const {
  bind();
  std::size_t bytes = 0;
  cuda::check(select_if(nullptr, bytes, capacity, nullptr, nullptr, nullptr, nullptr), "sizing a selection",
              Where::current());
  return bytes;
}

}  // namespace fathom::exec
