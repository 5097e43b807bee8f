#include "device/device_detection.hpp"
#include "device/device_simulator_impl.hpp"
#include "device/make.hpp"
#include "exec/sycl/sycl_device.hpp"

namespace fathom::device {

template class DeviceSimulator<exec::SyclDevice>;

std::unique_ptr<Simulator> make_sycl(const WorldDef& def, int index) {
  return std::make_unique<DeviceSimulator<exec::SyclDevice>>(def, index);
}

std::unique_ptr<Detection> detection_on_sycl(const WorldDef& def, int index) {
  return std::make_unique<DeviceDetection<exec::SyclDevice>>(def, index);
}

}  // namespace fathom::device
