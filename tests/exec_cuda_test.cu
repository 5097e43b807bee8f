// The execution layer on CUDA: the suite of exec_suite.hpp in a separate program, for carrying to a machine with a GPU.
// Without a GPU all tests are skipped.
#include <cstdio>

#include "collision/eight.hpp"
#include "exec/backends.hpp"
#include "exec/buffer.hpp"
#include "exec/cuda/cuda_device.cuh"
#include "exec/load.hpp"
#include "exec_crash.hpp"
#include "exec_queue_suite.hpp"
#include "exec_suite.hpp"

namespace fathom::exec::test {

template <>
std::unique_ptr<CudaDevice> make_device<CudaDevice>() {
  return cuda_device_infos()[0].available ? std::make_unique<CudaDevice>(0) : nullptr;
}
INSTANTIATE_TYPED_TEST_SUITE_P(Cuda, ExecTest, CudaDevice);
INSTANTIATE_TYPED_TEST_SUITE_P(Cuda, ExecQueueTest, CudaDevice);

TEST(CudaDeviceCrash, IsReportedAndTheProgramGoesOn) { expect_crash_to_be_reported<CudaDevice>(); }

struct SearchByTeams {
  struct Result {
    float least;
    int index;
    unsigned below_zero;
  };
  static constexpr bool runs_in_teams = true;
  const float* numbers;  // eight per item
  Result* results;

  FATHOM_HD void operator()(std::uint32_t i) const {
    const EightInts lanes = lane_numbers();
    const Eight mine{numbers[8 * i + static_cast<std::uint32_t>(lanes.lane)]};
    const LeastLane least = min_lane(mine, lanes);
    const unsigned below_zero = bits(mine < eight(0.0f));
    if (team::is_leader()) results[i] = {least.value, least.index, below_zero};
  }
};

TEST(CudaTeams, FindTheFirstOfTheLeast) {
  const auto gpu = make_device<CudaDevice>();
  if (!gpu) GTEST_SKIP() << "no GPU";
  constexpr std::uint32_t items = 10'000;
  std::vector<float> numbers;
  for (const std::uint32_t n : random_numbers<std::uint32_t>(8 * items, 9))
    numbers.push_back(static_cast<float>(n) - 4);
  const Buffer<float> in = to_device(*gpu, numbers);
  Buffer<SearchByTeams::Result> out(*gpu, items);
  gpu->parallel_for(items, SearchByTeams{in.data(), out.data()});
  const auto results = to_host(*gpu, out);
  for (std::uint32_t i = 0; i < items; ++i) {
    const auto begin = numbers.begin() + 8 * i, least = std::min_element(begin, begin + 8);
    ASSERT_EQ(results[i].least, *least);
    ASSERT_EQ(results[i].index, least - begin);
    for (int lane = 0; lane < 8; ++lane) ASSERT_EQ(results[i].below_zero >> lane & 1, begin[lane] < 0 ? 1u : 0u);
  }
}

/// Waits as the solver's sweeps wait for bodies (device/solve.hpp), but for a quad that nothing writes.
struct WaitForNothing {
  struct alignas(16) Quad {
    float x, y, z, w;
  };
  const Quad* quad;

  FATHOM_HD void operator()(std::uint32_t) const {
    for (Patience patience;; patience.look_again())
      if (all_ready(load_shared_quad(*quad).w != 0)) return;
  }
};

TEST(CudaDeviceCrash, EndsAWaitForDataThatNeverCome) {
  expect_crash_to_be_reported<CudaDevice>([](CudaDevice& gpu) {
    static Buffer<WaitForNothing::Quad> quad(gpu);
    quad.grow(1);
    gpu.zero(quad.data(), 1);
    gpu.parallel_for(64, WaitForNothing{quad.data()});
  });
}

}  // namespace fathom::exec::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  const int result = RUN_ALL_TESTS();
  const auto& unit = *testing::UnitTest::GetInstance();
  if (testing::GTEST_FLAG(list_tests)) return result;
  const fathom::exec::DeviceInfo device = fathom::exec::cuda_device_infos()[0];
  std::printf("cuda: %s\n", device.available ? device.name.c_str() : device.why_not.c_str());
  std::printf("%d passed, %d failed, %d skipped\n", unit.successful_test_count(), unit.failed_test_count(),
              unit.skipped_test_count());
  return result;
}
