#include "exec/cuda/check.hpp"

#include <string>

namespace fathom::exec::cuda {

bool is_lost_after(cudaError_t result) {
  switch (result) {
    case cudaErrorIllegalAddress:
    case cudaErrorLaunchTimeout:
    case cudaErrorAssert:
    case cudaErrorHardwareStackError:
    case cudaErrorIllegalInstruction:
    case cudaErrorMisalignedAddress:
    case cudaErrorInvalidAddressSpace:
    case cudaErrorInvalidPc:
    case cudaErrorLaunchFailure:
    case cudaErrorECCUncorrectable:
      return true;
    default:
      return false;
  }
}

void check(cudaError_t result, const char* what, const Where& where, std::size_t bytes) {
  if (result == cudaSuccess) return;
  (void)cudaGetLastError();
  const std::string text = std::string(what) + ": " + cudaGetErrorString(result);
  if (is_lost_after(result)) throw DeviceError(ErrorCode::unavailable, text + "; the device is lost", bytes, where);
  throw DeviceError(ErrorCode::capacity, text, bytes, where);
}

}  // namespace fathom::exec::cuda
