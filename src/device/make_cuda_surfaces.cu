#include "device/surfaces.hpp"
#include "exec/cuda/cuda_device.cuh"

namespace fathom::device {

template void collide_surfaces(exec::CudaDevice&, const ContactChanges&, const SurfaceWork&, float);

}  // namespace fathom::device
