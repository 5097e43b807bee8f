// Stubs for back ends that this build lacks.
#include "exec/backends.hpp"

namespace fathom::exec {

namespace {

[[maybe_unused]] std::vector<DeviceInfo> absent(Backend backend, const char* why_not) {
  DeviceInfo info;
  info.backend = backend;
  info.why_not = why_not;
  return {info};
}

}  // namespace

#if !defined(FATHOM_HAS_CUDA)
std::vector<DeviceInfo> cuda_device_infos() {
  return absent(Backend::cuda,
                "this build has no CUDA back end (configure with FATHOM_CUDA=ON where nvcc is installed)");
}
#endif

#if !defined(FATHOM_HAS_SYCL)
std::vector<DeviceInfo> sycl_device_infos() {
  return absent(Backend::sycl, "this build has no SYCL back end (configure where CMake finds AdaptiveCpp)");
}
#endif

}  // namespace fathom::exec
