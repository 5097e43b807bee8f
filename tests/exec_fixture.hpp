// Shared by the tests of the execution layer: two suites, exec_suite.hpp and exec_queue_suite.hpp, for every device.
// exec_test.cpp runs them on the host, exec_cuda_test.cu on CUDA, exec_sycl_test.cpp through SYCL.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <numeric>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "exec/atomic.hpp"
#include "exec/device.hpp"
#include "exec/host/host_group.hpp"
#include "exec/reduce.hpp"

namespace fathom::exec::test {

/// How the suite gets a device; null if the machine has none, which skips the tests.
template <class D>
std::unique_ptr<D> make_device();

template <class D>
class ExecTest : public testing::Test {
 protected:
  void SetUp() override {
    device_ = make_device<D>();
    if (!device_) GTEST_SKIP() << "no such device on this machine";
  }
  D& device() { return *device_; }

 private:
  std::unique_ptr<D> device_;
};

// Sizes around every internal boundary: work-groups, the host's chunks, single-tile sorts.
inline constexpr std::array<std::uint32_t, 11> sizes{0, 1, 2, 31, 129, 255, 1000, 4097, 8193, 65537, 1'000'003};

template <class T>
std::vector<T> random_numbers(std::size_t n, std::uint64_t below, std::uint32_t seed = 1) {
  std::mt19937_64 engine(seed);
  std::vector<T> numbers(n);
  for (T& number : numbers) number = static_cast<T>(below == 0 ? engine() : engine() % below);
  return numbers;
}

/// Sends a vector to the device, followed by `spare` zeros.
template <class T>
Buffer<T> to_device(auto& device, const std::vector<T>& items, std::size_t spare = 0) {
  Buffer<T> buffer(device, items.size() + spare);
  PinnedBuffer<T> staging(device, items.size());
  std::copy(items.begin(), items.end(), staging.begin());
  device.zero(buffer.data(), buffer.size());
  device.copy_to_device(buffer.data(), staging.data(), items.size());
  device.wait();
  return buffer;
}
template <class T>
std::vector<T> to_host(auto& device, const Buffer<T>& buffer, std::size_t n) {
  PinnedBuffer<T> staging(device, n);
  device.copy_to_host(staging.data(), buffer.data(), n);
  device.wait();
  return {staging.begin(), staging.end()};
}
template <class T>
std::vector<T> to_host(auto& device, const Buffer<T>& buffer) {
  return to_host(device, buffer, buffer.size());
}

struct Triple {
  const std::uint32_t* in;
  std::uint32_t* out;
  FATHOM_HD void operator()(std::uint32_t i) const { out[i] = 3 * in[i] + i; }
};

/// Phase p adds to each of its items its neighbour's value after phase p−1: wrong unless phases run in sequence.
struct Neighbours {
  const std::uint32_t* phase_count;
  std::uint32_t* values;  // one row per phase
  std::uint32_t width;
  FATHOM_HD std::uint32_t phases() const { return *phase_count; }
  FATHOM_HD std::uint32_t items(std::uint32_t phase) const { return width - phase - 1; }
  FATHOM_HD void operator()(std::uint32_t phase, std::uint32_t item) const {
    const std::uint32_t* const before = values + phase * width;
    values[(phase + 1) * width + item] = before[item] + before[item + 1];
  }
};

}  // namespace fathom::exec::test
