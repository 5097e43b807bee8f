// Selects the simulator for a configuration on this machine.
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
/// 1. `simulator.kind = "native"` is the native simulator: `devices` are ignored.
/// 2. Otherwise the device that `simulator.device` selects is used, if it exists.
/// 3. If it does not, `simulator.fallback` decides: the native simulator with a warning that says why, or the error.
/// Throws `Error{invalid_argument}` if `simulator.device` is not a valid selection.
SimulatorChoice choose_simulator(const Settings& settings, std::span<const exec::DeviceInfo> devices, Log& log);
/// The same for the devices of this machine; sets the configuration to the chosen simulator and device.
void choose_simulator(Config& config, Log& log);

}  // namespace fathom::engine
