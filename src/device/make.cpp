#include "device/make.hpp"

#include "exec/devices.hpp"

namespace fathom {

namespace {

/// Calls `Make` for the back end that `def.device` names.
template <class Make>
auto make_on(const WorldDef& def) {
  const std::vector<exec::DeviceInfo> devices = exec::list_devices();
  const exec::DeviceInfo& chosen = exec::select_device(def.device, devices);
  switch (chosen.backend) {
#if defined(FATHOM_HAS_CUDA)
    case exec::Backend::cuda:
      return Make::cuda(def, chosen.index);
#endif
#if defined(FATHOM_HAS_SYCL)
    case exec::Backend::sycl:
      return Make::sycl(def, chosen.index);
#endif
    default:
      return Make::host(def);
  }
}

struct MakeSimulator {
  static auto host(const WorldDef& def) { return device::make_host(def); }
  static auto cuda(const WorldDef& def, int index) { return device::make_cuda(def, index); }
  static auto sycl(const WorldDef& def, int index) { return device::make_sycl(def, index); }
};
struct MakeDetection {
  static auto host(const WorldDef& def) { return device::detection_on_host(def); }
  static auto cuda(const WorldDef& def, int index) { return device::detection_on_cuda(def, index); }
  static auto sycl(const WorldDef& def, int index) { return device::detection_on_sycl(def, index); }
};

}  // namespace

std::unique_ptr<Simulator> make_device_simulator(const WorldDef& def) { return make_on<MakeSimulator>(def); }
std::unique_ptr<device::Detection> device::make_detection(const WorldDef& def) { return make_on<MakeDetection>(def); }

}  // namespace fathom
