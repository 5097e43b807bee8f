// Which simulator a configuration comes to on this machine.
#pragma once

#include <span>
#include <string>

#include "engine/config.hpp"
#include "engine/log.hpp"
#include "exec/devices.hpp"

namespace fathom::engine {

struct SimulatorChoice {
  SimulatorKind kind = SimulatorKind::native;
  std::string device = "auto";
};

/// Rules, in this order; each is logged:
/// 1. `simulator.kind = "native"` is the native simulator: `devices` are not looked at.
/// 2. Otherwise the device that `simulator.device` selects is taken where it is there.
/// 3. Where it is not, `simulator.fallback` decides: the native simulator with a warning that says why, or the error.
/// Throws `Error{invalid_argument}` where `simulator.device` is no selection.
SimulatorChoice choose_simulator(const Settings& settings, std::span<const exec::DeviceInfo> devices, Log& log);
/// The same for the devices of this machine; gives the configuration the simulator and device that it comes to.
void choose_simulator(Config& config, Log& log);

}  // namespace fathom::engine
