// Which simulator a configuration comes to on this machine.
#pragma once

#include <span>
#include <string>

#include "engine/config.hpp"
#include "engine/log.hpp"
#include "exec/devices.hpp"

namespace fathom::engine {

struct SimulatorChoice {
  std::string kind = "native";
  std::string device{};  ///< empty for the native simulator
};

/// Rules, in this order; each is logged:
/// 1. `simulator.kind = "native"` is the native simulator; devices are not looked at, but `simulator.device` must
///    be a selection.
/// 2. Otherwise the device that `simulator.device` selects is taken where it is there.
/// 3. Where it is not, `simulator.fallback` decides: the native simulator with a warning that says why, or the error.
SimulatorChoice choose_simulator(const Settings& settings, std::span<const exec::DeviceInfo> devices, Log& log);

}  // namespace fathom::engine
