// Kernels that crash on a GPU. This disables the device for the whole program, so each test is a separate program (a
// death test); on processors the program would end, so it is for GPUs only.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "exec_fixture.hpp"

namespace fathom::exec::test {

template <class D>
void write_nowhere(D& device) {
  device.fill(static_cast<std::uint32_t*>(nullptr) + 16, 1, 1u);
}

/// Exits with 0 if the waiting line reports the crash and the program continues.
template <class D>
void crash_and_exit(void (*crash)(D&)) {
  const auto device = make_device<D>();
  unsigned line = 0;
  try {
    crash(*device);
    line = __LINE__ + 1;
    device->wait();
  } catch (const DeviceError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    std::_Exit(error.code() == ErrorCode::unavailable && error.where().line == line ? 0 : 1);
  }
  std::_Exit(2);
}

template <class D>
void expect_crash_to_be_reported(void (*crash)(D&) = write_nowhere<D>) {
  const auto device = make_device<D>();
  if (!device || !device->info().is_gpu) GTEST_SKIP() << "no such GPU on this machine";
  testing::GTEST_FLAG(death_test_style) = "threadsafe";
  EXPECT_EXIT(crash_and_exit<D>(crash), testing::ExitedWithCode(0), "the device is lost.*exec_crash.hpp");
}

}  // namespace fathom::exec::test
