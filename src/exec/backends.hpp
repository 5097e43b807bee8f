// What each back end reports of the machine. A back end that is not built has a stand-in in its place
// (backends_absent.cpp), so that the list of devices needs no conditional code.
#pragma once

#include <vector>

#include "exec/devices.hpp"

namespace fathom::exec {

DeviceInfo host_device_info();
std::vector<DeviceInfo> cuda_device_infos();
std::vector<DeviceInfo> sycl_device_infos();

}  // namespace fathom::exec
