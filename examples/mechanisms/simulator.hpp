// Selects the simulator that an example's first argument names.
#pragma once

#include <fathom/world.hpp>
#include <string>

/// A default definition for `native`, `device` or `hybrid`; `native` if no argument is given. Throws
/// `Error{invalid_argument}` for any other name.
inline fathom::WorldDef world_definition(int argc, char** argv) {
  const std::string name = argc > 1 ? argv[1] : "native";
  fathom::WorldDef def;
  if (name == "device")
    def.simulator = fathom::SimulatorKind::device;
  else if (name == "hybrid")
    def.simulator = fathom::SimulatorKind::hybrid;
  else if (name != "native")
    throw fathom::Error(fathom::ErrorCode::invalid_argument,
                        "simulator '" + name + "' is unknown; name native, device or hybrid");
  return def;
}
