// What every back end of the execution layer must do with submissions: graphs, events, copies beside the queue, and
// what it rejects. Instantiated like exec_suite.hpp.
#pragma once

#include <thread>

#include "exec_fixture.hpp"

namespace fathom::exec::test {

template <class D>
class ExecQueueTest : public ExecTest<D> {};
TYPED_TEST_SUITE_P(ExecQueueTest);

TYPED_TEST_P(ExecQueueTest, AGraphReplaysWithOtherCounts) {
  constexpr std::uint32_t capacity = 50'000;
  const auto input = random_numbers<std::uint32_t>(capacity, 1000);
  const Buffer<std::uint32_t> in = to_device(this->device(), input);
  Buffer<std::uint32_t> tripled(this->device(), capacity), indices(this->device(), capacity), counts(this->device(), 3);
  PinnedBuffer<std::uint32_t> count(this->device(), 1), result(this->device(), 3);
  Scratch scratch(this->device());
  scratch.reserve(this->device().template sort_scratch_bytes<std::uint32_t>(capacity));
  scratch.reserve(this->device().scan_scratch_bytes(capacity));
  scratch.reserve(this->device().select_scratch_bytes(capacity));
  scratch.reserve(reduce_scratch_bytes<std::uint32_t>());
  std::uint32_t* const c = counts.data();
  const Range range(c, capacity);
  auto& device = this->device();
  const Traffic before = device.traffic();
  auto graph = device.record([&] {
    device.copy_to_device(c, count.data(), 1);
    device.fill(indices.data(), capacity, 0u);
    device.parallel_for(range, Triple{in.data(), tripled.data()});
    device.select(scratch, range, tripled.data(), indices.data(), c + 1);
    device.sort_by_key(scratch, range, tripled.data(), indices.data());
    device.exclusive_scan(scratch, range, tripled.data(), tripled.data());
    reduce(device, scratch, range, LoadFrom<std::uint32_t>{tripled.data()}, Max{}, 0u, c + 2);
    device.copy_to_host(result.data(), c, 3);
  });
  EXPECT_EQ(device.traffic().launches, before.launches) << "recording runs nothing";
  for (const std::uint32_t n : {0u, 10u, 49'999u, 3u}) {
    count[0] = n;
    device.launch(graph);
    device.wait();
    std::vector<std::uint32_t> expected(n);
    std::uint32_t selected = 0;
    for (std::uint32_t i = 0; i < n; ++i) selected += (expected[i] = 3 * input[i] + i) != 0;
    std::sort(expected.begin(), expected.end());
    std::exclusive_scan(expected.begin(), expected.end(), expected.begin(), 0u);
    EXPECT_EQ(result[1], selected);
    EXPECT_EQ(result[2], n == 0 ? 0 : *std::max_element(expected.begin(), expected.end()));
    EXPECT_EQ(to_host(device, tripled, n), expected);
  }
  EXPECT_GE(device.traffic().launches - before.launches, 4u * 6u);
  EXPECT_EQ(device.traffic().bytes_to_device - before.bytes_to_device, 4u * 4u);
}

TYPED_TEST_P(ExecQueueTest, ARecordingThatThrowsLeavesTheDeviceUsable) {
  auto& device = this->device();
  Buffer<std::uint32_t> words = to_device(device, std::vector{1u, 2u});
  EXPECT_THROW((void)device.record([&] { Buffer<float>(device, 10); }), DeviceError);
  EXPECT_THROW((void)device.record([&] { (void)device.record([] {}); }), DeviceError);
  EXPECT_FALSE(device.is_recording());
  device.fill(words.data(), 2, 5u);
  EXPECT_EQ(to_host(device, words), (std::vector{5u, 5u}));
}

TYPED_TEST_P(ExecQueueTest, AFailedAllocationNamesItsPlaceAndSize) {
  auto& device = this->device();
  Buffer<std::uint64_t> buffer = to_device(device, std::vector<std::uint64_t>{1, 2, 3});
  constexpr std::size_t size = std::size_t{1} << 47;
  const unsigned line = __LINE__ + 2;
  try {
    buffer.grow(size);
    FAIL() << "a pebibyte was granted";
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.code(), ErrorCode::capacity);
    EXPECT_EQ(error.bytes(), size * 8);
    EXPECT_EQ(error.where().line, line);
    EXPECT_NE(std::string(error.what()).find("exec_queue_suite.hpp:" + std::to_string(line)), std::string::npos)
        << error.what();
    EXPECT_NE(std::string(error.what()).find("1.0 PiB"), std::string::npos) << error.what();
  }
  EXPECT_EQ(to_host(device, buffer), (std::vector<std::uint64_t>{1, 2, 3})) << "the buffer is as it was";
  EXPECT_THROW(buffer.grow(~std::size_t{0}), DeviceError) << "bytes that overflow";
  EXPECT_THROW(PinnedBuffer<std::uint64_t>(device, size), DeviceError);
}

TYPED_TEST_P(ExecQueueTest, RefusesWhatCannotRun) {
  auto& device = this->device();
  Buffer<std::uint32_t> words(device, 8);
  Scratch scratch(device);
  EXPECT_THROW(device.parallel_for(max_items + 1, Fill<std::uint32_t>{words.data(), 0}), DeviceError);
  EXPECT_THROW(device.sort_by_key(scratch, 8, words.data(), words.data()), DeviceError) << "no scratch";
  device.fill(words.data(), 8, 3u);
  EXPECT_EQ(to_host(device, words), std::vector<std::uint32_t>(8, 3u));
}

TYPED_TEST_P(ExecQueueTest, EventsTellTimeAndCompletion) {
  auto& device = this->device();
  Buffer<std::uint32_t> numbers = to_device(device, random_numbers<std::uint32_t>(1 << 20, 0));
  typename TypeParam::Event begin(device), end(device), inside(device);
  device.mark(begin);
  device.parallel_for(1 << 20, Triple{numbers.data(), numbers.data()});
  device.mark(end);
  end.wait();
  EXPECT_TRUE(end.is_done());
  EXPECT_TRUE(begin.is_done());
  EXPECT_GT(end.milliseconds_since(begin), 0.0);
  EXPECT_LT(end.milliseconds_since(begin), 5000.0);

  auto graph = device.record([&] {
    device.parallel_for(1 << 20, Triple{numbers.data(), numbers.data()});
    device.mark(inside);
  });
  device.launch(graph);
  std::thread([&] { inside.wait(); }).join();
  EXPECT_GE(inside.milliseconds_since(end), 0.0);
}

TYPED_TEST_P(ExecQueueTest, WhatComesLaterWaitsForCopiesToTheDevice) {
  auto& device = this->device();
  constexpr std::uint32_t size = 1 << 20;
  const auto numbers = random_numbers<std::uint32_t>(size, 1000);
  PinnedBuffer<std::uint32_t> from(device, size);
  std::copy(numbers.begin(), numbers.end(), from.begin());
  Buffer<std::uint32_t> one(device, size), other(device, size);
  device.wait();
  device.copy_to_device_aside(one.data(), from.data(), size);
  device.parallel_for(size, Triple{one.data(), other.data()});
  const auto result = to_host(device, other);
  for (std::uint32_t i = 0; i < size; ++i) ASSERT_EQ(result[i], 3 * numbers[i] + i);
}

TYPED_TEST_P(ExecQueueTest, CopiesAsideSeeWhatCameBefore) {
  auto& device = this->device();
  constexpr std::uint32_t size = 1 << 20;
  auto numbers = random_numbers<std::uint32_t>(size, 1000);
  Buffer<std::uint32_t> one = to_device(device, numbers), other(device, size);
  PinnedBuffer<std::uint32_t> result(device, size);
  typename TypeParam::Event copied(device);
  for (int round = 0; round < 3; ++round) {
    device.parallel_for(size, Triple{one.data(), other.data()});
    device.copy_to_host_aside(result.data(), other.data(), size);
    device.mark_aside(copied);
    device.parallel_for(size, Triple{one.data(), one.data()});
    for (std::uint32_t i = 0; i < size; ++i) numbers[i] = 3 * numbers[i] + i;
    copied.wait();
    ASSERT_TRUE(std::equal(numbers.begin(), numbers.end(), result.begin())) << "round " << round;
  }
  device.wait();
}

TYPED_TEST_P(ExecQueueTest, AGraphHoldsPhases) {
  auto& device = this->device();
  constexpr std::uint32_t width = 5000, most = 12;
  const auto input = random_numbers<std::uint32_t>(width, 0);
  const Buffer<std::uint32_t> start = to_device(device, input);
  Buffer<std::uint32_t> values(device, std::size_t{width} * (most + 1)), phase_count(device, 1);
  PinnedBuffer<std::uint32_t> count(device, 1);
  auto graph = device.record([&] {
    device.copy_to_device(phase_count.data(), count.data(), 1);
    device.zero(values.data(), values.size());
    device.copy(values.data(), start.data(), width);
    device.parallel_phases(most, width, Neighbours{phase_count.data(), values.data(), width});
    device.parallel_for(1, Triple{values.data(), values.data()});
  });
  for (const std::uint32_t phases : {0u, 3u, most, 2u}) {
    count[0] = phases;
    device.launch(graph);
    std::vector<std::uint32_t> expected(values.size());
    std::copy(input.begin(), input.end(), expected.begin());
    for (std::uint32_t phase = 0; phase < phases; ++phase) {
      Neighbours kernel{nullptr, expected.data(), width};
      for (std::uint32_t i = 0; i < kernel.items(phase); ++i) kernel(phase, i);
    }
    expected[0] *= 3;
    ASSERT_EQ(to_host(device, values), expected) << phases << " phases";
  }
}

TYPED_TEST_P(ExecQueueTest, EventsInAGraphAreMarkedByEachReplay) {
  auto& device = this->device();
  constexpr std::uint32_t n = 1 << 20;
  Buffer<std::uint32_t> numbers = to_device(device, random_numbers<std::uint32_t>(n, 0));
  typename TypeParam::Event before(device), begin(device), end(device), between(device);
  EXPECT_TRUE(end.is_done()) << "never marked";
  auto graph = device.record([&] {
    device.mark(begin);
    for (int i = 0; i < 10; ++i) device.parallel_for(n, Triple{numbers.data(), numbers.data()});
    device.mark(end);
  });
  EXPECT_TRUE(end.is_done()) << "only recorded";
  device.mark(before);
  device.launch(graph);
  end.wait();
  const double first = end.milliseconds_since(before);
  EXPECT_GT(end.milliseconds_since(begin), 0.0);
  EXPECT_GE(first, end.milliseconds_since(begin));
  device.mark(between);
  device.launch(graph);
  device.launch(graph);
  device.wait();
  EXPECT_TRUE(end.is_done());
  EXPECT_GT(begin.milliseconds_since(between), 0.0) << "marked by the last replay, not by the first";
  EXPECT_GT(end.milliseconds_since(begin), 0.0);
}

REGISTER_TYPED_TEST_SUITE_P(ExecQueueTest, AGraphReplaysWithOtherCounts, ARecordingThatThrowsLeavesTheDeviceUsable,
                            AFailedAllocationNamesItsPlaceAndSize, RefusesWhatCannotRun, EventsTellTimeAndCompletion,
                            WhatComesLaterWaitsForCopiesToTheDevice, CopiesAsideSeeWhatCameBefore, AGraphHoldsPhases,
                            EventsInAGraphAreMarkedByEachReplay);

}  // namespace fathom::exec::test
