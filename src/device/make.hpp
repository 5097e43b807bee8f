// Factories of device simulators, and of collision detection only, for each back end that may be built.
#pragma once

#include <memory>

#include "device/detection.hpp"
#include "world/simulator.hpp"

namespace fathom::device {

std::unique_ptr<Simulator> make_host(const WorldDef& def);
std::unique_ptr<Simulator> make_cuda(const WorldDef& def, int index);
std::unique_ptr<Simulator> make_sycl(const WorldDef& def, int index);

std::unique_ptr<Detection> detection_on_host(const WorldDef& def);
std::unique_ptr<Detection> detection_on_cuda(const WorldDef& def, int index);
std::unique_ptr<Detection> detection_on_sycl(const WorldDef& def, int index);

}  // namespace fathom::device
