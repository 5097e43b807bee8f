// The execution layer on SYCL: the suite of exec_suite.hpp, compiled by a SYCL compiler.
#include "exec/backends.hpp"
#include "exec/sycl/sycl_device.hpp"
#include "exec_crash.hpp"
#include "exec_queue_suite.hpp"
#include "exec_suite.hpp"

namespace fathom::exec::test {

template <>
std::unique_ptr<SyclDevice> make_device<SyclDevice>() {
  return sycl_device_infos()[0].available ? std::make_unique<SyclDevice>(0) : nullptr;
}
INSTANTIATE_TYPED_TEST_SUITE_P(Sycl, ExecTest, SyclDevice);
INSTANTIATE_TYPED_TEST_SUITE_P(Sycl, ExecQueueTest, SyclDevice);

TEST(SyclDeviceCrash, IsReportedAndTheProgramGoesOn) { expect_crash_to_be_reported<SyclDevice>(); }

}  // namespace fathom::exec::test
