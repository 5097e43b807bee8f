// What a validation runs on. Every case gets its world definition here, so that the same code tests all simulators.
#pragma once

#include <cstdint>
#include <fathom/world.hpp>
#include <functional>
#include <string>

namespace fathom::validate {

struct Setup {
  SimulatorKind simulator = SimulatorKind::native;
  std::string device = "auto";  ///< for the device simulator
  int threads = 1;
  bool full = true;              ///< false: the short form that is part of the test suite
  int heap_seeds = 0;            ///< number of random heaps; 0: 60, or in the short form 6 (2 on surfaces)
  std::uint64_t first_heap = 1;  ///< seed of the first
  std::function<void(const std::string&)> say{};  ///< called with a line for each heap that fails
};

/// A definition with the setup's simulator and threads, sleeping off.
WorldDef world_def(const Setup& setup);

}  // namespace fathom::validate
