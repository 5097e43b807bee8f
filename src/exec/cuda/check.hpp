// Turns the CUDA runtime's result codes into DeviceError.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>

#include "exec/error.hpp"

namespace fathom::exec::cuda {

/// Throws unless `result` is success. Clears the runtime's last error, or the next call would be blamed for it; a
/// crashed kernel cannot be cleared, and the text then says that the device is lost.
void check(cudaError_t result, const char* what, const Where& where, std::size_t bytes = 0);

/// Whether this is a failure of a running kernel, after which the context and all its memory are lost.
bool is_lost_after(cudaError_t result);

}  // namespace fathom::exec::cuda
