#include "exec/devices.hpp"

#include <fmt/format.h>

#include "commands.hpp"
#include "exec/error.hpp"

namespace fathom::cli {
namespace {

std::string selection_of(const exec::DeviceInfo& device) {
  const std::string_view backend = exec::name_of(device.backend);
  // Only these back ends can have several devices; an entry for none has no number.
  const bool is_numbered = device.backend != exec::Backend::host && !device.name.empty();
  return is_numbered ? fmt::format("{}:{}", backend, device.index) : std::string(backend);
}

}  // namespace

int devices() {
  fmt::print("{:<8} {:>11} {:>6}  {}\n", "device", "memory", "units", "name");
  for (const exec::DeviceInfo& device : exec::list_devices()) {
    const bool has_hardware = !device.name.empty();
    fmt::print("{:<8} {:>11} {:>6}  {}\n", selection_of(device), has_hardware ? exec::bytes_text(device.memory) : "-",
               has_hardware ? std::to_string(device.compute_units) : "-",
               device.available
                   ? device.name
                   : fmt::format("{}unavailable: {}", has_hardware ? device.name + ", " : "", device.why_not));
  }
  fmt::print("\nUnits are hardware threads of a processor and multiprocessors (compute units) of a GPU.\n");
  return finished;
}

}  // namespace fathom::cli
