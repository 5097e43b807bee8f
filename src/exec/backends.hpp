// The devices that each back end reports. A back end that is not built is replaced by a stub (backends_absent.cpp), so
// that the list of devices needs no conditional code.
#pragma once

#include <vector>

#include "exec/devices.hpp"

namespace fathom::exec {

DeviceInfo host_device_info();
std::vector<DeviceInfo> cuda_device_infos();
std::vector<DeviceInfo> sycl_device_infos();

}  // namespace fathom::exec
