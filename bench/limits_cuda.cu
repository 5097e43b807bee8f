#include "exec/cuda/cuda_device.cuh"
#include "limits_primitives.hpp"

namespace fathom::bench {

Limits register_cuda(int index) { return Primitives<CudaDevice>(std::make_shared<CudaDevice>(index)).add(); }

}  // namespace fathom::bench
