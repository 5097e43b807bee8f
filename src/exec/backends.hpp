// The devices that each back end reports. A stub (backends_absent.cpp) replaces a back end that is not built, so the
// list of devices needs no conditional code.
#pragma once

#include <vector>

#include "exec/devices.hpp"

namespace fathom::exec {

DeviceInfo host_device_info();
std::vector<DeviceInfo> cuda_device_infos();
std::vector<DeviceInfo> sycl_device_infos();

}  // namespace fathom::exec
