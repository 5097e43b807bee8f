#include "engine/simulator_choice.hpp"

#include <fathom/error.hpp>

namespace fathom::engine {

SimulatorChoice choose_simulator(const Settings& settings, std::span<const exec::DeviceInfo> devices, Log& log) {
  exec::parse_device(settings.simulator.device);
  if (settings.simulator.kind == SimulatorKind::native) {
    log.debug("simulator: native");
    return {};
  }
  for (const exec::DeviceInfo& device : devices)
    log.debug("device {}:{}: {}{}", exec::name_of(device.backend), device.index,
              device.name.empty() ? "none" : device.name, device.available ? "" : ", not available: " + device.why_not);
  try {
    const exec::DeviceInfo& device = exec::select_device(settings.simulator.device, devices);
    const std::string name = std::string(exec::name_of(device.backend)) +
                             (device.backend == exec::Backend::host ? "" : ":" + std::to_string(device.index));
    log.info("simulator: {}, on {} ({})", settings.simulator.kind == SimulatorKind::device ? "device" : "hybrid", name,
             device.name);
    return {settings.simulator.kind, name};
  } catch (const Error& error) {
    if (!settings.simulator.fallback) throw;
    log.warning("{}; the native simulator takes its place (simulator.fallback)", error.what());
    return {};
  }
}

}  // namespace fathom::engine
