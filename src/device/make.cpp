#include "device/make.hpp"

#include "exec/devices.hpp"

namespace fathom {

std::unique_ptr<Simulator> make_device_simulator(const WorldDef& def) {
  const std::vector<exec::DeviceInfo> devices = exec::list_devices();
  const exec::DeviceInfo& chosen = exec::select_device(def.device, devices);
  switch (chosen.backend) {
#if defined(FATHOM_HAS_CUDA)
    case exec::Backend::cuda:
      return device::make_cuda(def, chosen.index);
#endif
#if defined(FATHOM_HAS_SYCL)
    case exec::Backend::sycl:
      return device::make_sycl(def, chosen.index);
#endif
    default:
      return device::make_host(def);
  }
}

}  // namespace fathom
