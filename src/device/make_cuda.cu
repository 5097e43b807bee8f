#include "device/device_detection.hpp"
#include "device/device_simulator_impl.hpp"
#include "device/make.hpp"
#include "exec/cuda/cuda_device.cuh"

namespace fathom::device {

extern template void collide_surfaces(exec::CudaDevice&, const ContactChanges&, const SurfaceWork&, float);
template class DeviceSimulator<exec::CudaDevice>;

std::unique_ptr<Simulator> make_cuda(const WorldDef& def, int index) {
  return std::make_unique<DeviceSimulator<exec::CudaDevice>>(def, index);
}

std::unique_ptr<Detection> detection_on_cuda(const WorldDef& def, int index) {
  return std::make_unique<DeviceDetection<exec::CudaDevice>>(def, index);
}

}  // namespace fathom::device
