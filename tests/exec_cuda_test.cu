// The execution layer on CUDA: the suite of exec_suite.hpp in a program of its own, which can be carried to a machine
// with a GPU. Where there is none, all tests are skipped.
#include <cstdio>

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

/// As the solver's sweeps wait for bodies (device/solve.hpp), for a quad that nobody writes.
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
