#include "device/simulator_queries.hpp"
#include "exec/cuda/cuda_device.cuh"

namespace fathom::device {

template bool DeviceSimulator<exec::CudaDevice>::cast_rays(const ManyRays&, const TakeHits&) const;
template bool DeviceSimulator<exec::CudaDevice>::cast_shapes(const ManyShapes&, const TakeHits&) const;
template bool DeviceSimulator<exec::CudaDevice>::overlap_shapes(const ManyShapes&, const TakeTouched&) const;

}  // namespace fathom::device
