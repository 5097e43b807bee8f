// The execution layer on the host, and the choice of devices.
#include <gmock/gmock.h>

#include <bit>

#include "exec/host/host_device.hpp"
#include "exec_queue_suite.hpp"
#include "exec_suite.hpp"

namespace fathom::exec::test {

// More threads than this machine has cores: threads steal chunks.
template <>
std::unique_ptr<HostDevice> make_device<HostDevice>() {
  return std::make_unique<HostDevice>(4);
}
INSTANTIATE_TYPED_TEST_SUITE_P(Host, ExecTest, HostDevice);
INSTANTIATE_TYPED_TEST_SUITE_P(Host, ExecQueueTest, HostDevice);

namespace {

using testing::HasSubstr;

DeviceInfo device_info(Backend backend, int index, bool available, const char* why_not = "") {
  DeviceInfo info;
  info.backend = backend;
  info.index = index;
  info.is_gpu = backend != Backend::host;
  info.available = available;
  info.why_not = why_not;
  return info;
}

std::string refusal(std::string_view selection, const std::vector<DeviceInfo>& devices, ErrorCode code) {
  try {
    (void)select_device(selection, devices);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    return error.what();
  }
  ADD_FAILURE() << selection << " was accepted";
  return {};
}

TEST(Devices, ListHasTheHostAndAReasonForAllThatIsMissing) {
  const std::vector<DeviceInfo> devices = list_devices();
  ASSERT_GE(devices.size(), 3u);
  EXPECT_EQ(devices[0].backend, Backend::host);
  EXPECT_TRUE(devices[0].available);
  EXPECT_GT(devices[0].memory, std::size_t{1} << 28);
  EXPECT_GE(devices[0].compute_units, 1u);
  for (const DeviceInfo& device : devices) {
    EXPECT_EQ(device.available, device.why_not.empty()) << name_of(device.backend) << ": " << device.why_not;
    EXPECT_TRUE(!device.available || !device.name.empty());
  }
}

TEST(Devices, AutoTakesTheFirstGpuElseTheHost) {
  std::vector<DeviceInfo> devices{device_info(Backend::host, 0, true), device_info(Backend::cuda, 0, false, "broken"),
                                  device_info(Backend::cuda, 1, true), device_info(Backend::sycl, 0, true)};
  EXPECT_EQ(&select_device("auto", devices), &devices[2]);
  devices[2].available = false;
  devices[3].is_gpu = false;
  EXPECT_EQ(&select_device("auto", devices), &devices[0]);
}

TEST(Devices, SelectionsAreReadInFull) {
  const std::vector<DeviceInfo> devices{device_info(Backend::host, 0, true), device_info(Backend::cuda, 0, true),
                                        device_info(Backend::cuda, 1, true),
                                        device_info(Backend::sycl, 0, false, "no driver")};
  EXPECT_EQ(&select_device("host", devices), &devices[0]);
  EXPECT_EQ(&select_device("cuda", devices), &devices[1]);
  EXPECT_EQ(&select_device("cuda:1", devices), &devices[2]);
  EXPECT_THAT(refusal("cuda:2", devices, ErrorCode::unavailable), HasSubstr("there are 2 cuda devices"));
  EXPECT_THAT(refusal("sycl", devices, ErrorCode::unavailable), HasSubstr("no driver"));
  EXPECT_THAT(refusal("sycl:3", devices, ErrorCode::unavailable), HasSubstr("no driver"));
  EXPECT_TRUE(parse_device("auto").automatic);
  EXPECT_EQ(parse_device("sycl:12").index, 12);
  EXPECT_EQ(find_device("host").backend, Backend::host);
  for (const char* text : {"", "gpu", "cuda:", "cuda:x", "cuda:1x", "cuda:-1", "host:1", "CUDA", "auto:0", "cudax"}) {
    EXPECT_THAT(refusal(text, devices, ErrorCode::invalid_argument), HasSubstr("auto, host, cuda"));
  }
}

/// Everything the layer computes, with an odd number of threads and items.
std::vector<std::uint32_t> run_all(int threads) {
  HostDevice device(threads);
  constexpr std::uint32_t n = 123'457;
  Buffer<std::uint32_t> keys = to_device(device, random_numbers<std::uint32_t>(n, 5000));
  Buffer<std::uint32_t> values(device, n);
  device.parallel_for(n, Triple{keys.data(), values.data()});
  const Buffer<float> floats = [&] {
    const auto numbers = random_numbers<std::uint32_t>(n, 1'000'000'000);
    return to_device(device, std::vector<float>(numbers.begin(), numbers.end()));
  }();
  Buffer<float> sum(device, 1);
  Scratch scratch(device);
  scratch.reserve(device.sort_scratch_bytes<std::uint32_t>(n));
  reduce(device, scratch, n, LoadFrom<float>{floats.data()}, Add{}, 0.0f, sum.data());
  device.sort_by_key(scratch, n, keys.data(), values.data());
  device.exclusive_scan(scratch, n, values.data(), keys.data());
  std::vector<std::uint32_t> result = to_host(device, keys);
  result.push_back(std::bit_cast<std::uint32_t>(to_host(device, sum)[0]));
  return result;
}

TEST(HostDevice, AnyNumberOfThreadsGivesTheSameBits) {
  const auto expected = run_all(1);
  for (const int threads : {2, 3, 5, 16}) EXPECT_EQ(run_all(threads), expected) << threads << " threads";
}

}  // namespace

}  // namespace fathom::exec::test
