// The primitives written as group kernels, which SYCL uses, run on the host through the whole suite.
#include "exec/host/host_device.hpp"
#include "exec/portable/radix_sort.hpp"
#include "exec_queue_suite.hpp"
#include "exec_suite.hpp"

namespace fathom::exec::test {

namespace {

class PortableHost : public HostDevice {
 public:
  using HostDevice::HostDevice;

  template <class Key>
  void sort_by_key(Scratch& scratch, Range range, Key* keys, std::uint32_t* values, int key_bits = 8 * sizeof(Key),
                   Where where = Where::current()) {
    portable::sort_by_key(*this, scratch, range, keys, values, key_bits, where);
  }
  void exclusive_scan(Scratch& scratch, Range range, const std::uint32_t* in, std::uint32_t* out,
                      std::uint32_t* total = nullptr, Where where = Where::current()) {
    portable::exclusive_scan(*this, scratch, range, in, out, total, where);
  }
  void select(Scratch& scratch, Range range, const std::uint32_t* flags, std::uint32_t* indices, std::uint32_t* count,
              Where where = Where::current()) {
    portable::select(*this, scratch, range, flags, indices, count, where);
  }
  template <class Key>
  std::size_t sort_scratch_bytes(std::uint32_t capacity) const {
    return portable::SortScratch<Key>(nullptr, capacity).bytes;
  }
  std::size_t scan_scratch_bytes(std::uint32_t capacity) const { return portable::scan_scratch_bytes(capacity); }
  std::size_t select_scratch_bytes(std::uint32_t capacity) const { return portable::scan_scratch_bytes(capacity); }
};

}  // namespace

template <>
std::unique_ptr<PortableHost> make_device<PortableHost>() {
  return std::make_unique<PortableHost>(3);
}
INSTANTIATE_TYPED_TEST_SUITE_P(PortableOnHost, ExecTest, PortableHost);
INSTANTIATE_TYPED_TEST_SUITE_P(PortableOnHost, ExecQueueTest, PortableHost);

}  // namespace fathom::exec::test
