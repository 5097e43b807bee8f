#include "engine/simulator_choice.hpp"

#include <fathom/error.hpp>
#include <vector>

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

void choose_simulator(Config& config, Log& log) {
  const Settings settings = *config.settled();
  // Listing devices starts their drivers, so only list them if one is wanted.
  const bool wants_device = settings.simulator.kind != SimulatorKind::native;
  const SimulatorChoice choice =
      choose_simulator(settings, wants_device ? exec::list_devices() : std::vector<exec::DeviceInfo>{}, log);
  if (!wants_device) return;
  if (choice.kind != settings.simulator.kind)
    config.give(
        "simulator.kind", "simulator.fallback", [&](Settings& s) { s.simulator.kind = choice.kind; }, Setter::program);
  else
    config.give("simulator.device", config.origin("simulator.device"),
                [&](Settings& s) { s.simulator.device = choice.device; });
}

}  // namespace fathom::engine
