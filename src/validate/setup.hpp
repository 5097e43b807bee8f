// What a validation runs on. Every case asks for its worlds here, so that all simulators go through the same code.
#pragma once

#include <cstdint>
#include <fathom/world.hpp>
#include <functional>
#include <string>

namespace fathom::validate {

struct Setup {
  SimulatorKind simulator = SimulatorKind::native;
  std::string device = "auto";  ///< of the device simulator
  int threads = 1;
  bool full = true;              ///< false: the shorter form that is part of the test suite
  int heap_seeds = 0;            ///< how many random heaps; 0: 60, in the shorter form 6, on surfaces 2
  std::uint64_t first_heap = 1;  ///< seed of the first
  std::function<void(const std::string&)> say{};  ///< called with a line for each heap that fails
};

/// A definition with the simulator and the threads of the setup, sleeping off.
WorldDef world_def(const Setup& setup);

}  // namespace fathom::validate
