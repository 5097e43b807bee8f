#include "device/device_detection.hpp"
#include "device/device_simulator_impl.hpp"
#include "device/make.hpp"
#include "exec/host/host_device.hpp"

namespace fathom::device {

template class DeviceSimulator<exec::HostDevice>;

std::unique_ptr<Simulator> make_host(const WorldDef& def) {
  return std::make_unique<DeviceSimulator<exec::HostDevice>>(def, def.threads);
}

std::unique_ptr<Detection> detection_on_host(const WorldDef& def) {
  return std::make_unique<DeviceDetection<exec::HostDevice>>(def, def.threads);
}

}  // namespace fathom::device
