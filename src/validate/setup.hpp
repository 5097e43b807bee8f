// What a validation runs on. Every case asks for its worlds here, so that all simulators go through the same code.
#pragma once

#include <fathom/world.hpp>
#include <string>

namespace fathom::validate {

struct Setup {
  SimulatorKind simulator = SimulatorKind::native;
  std::string device = "auto";  ///< of the device simulator
  int threads = 1;
  bool full = true;  ///< false: the shorter form that is part of the test suite
};

/// A definition with the simulator and the threads of the setup, sleeping off.
WorldDef world_def(const Setup& setup);

}  // namespace fathom::validate
