// One maker of device simulators for each back end that may be built.
#pragma once

#include <memory>

#include "world/simulator.hpp"

namespace fathom::device {

std::unique_ptr<Simulator> make_host(const WorldDef& def);
std::unique_ptr<Simulator> make_cuda(const WorldDef& def, int index);
std::unique_ptr<Simulator> make_sycl(const WorldDef& def, int index);

}  // namespace fathom::device
