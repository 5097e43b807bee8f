// State hashes that every build on every machine must reproduce: the environments after some steps.
#pragma once

#include <cstdint>
#include <span>

#include "scene/scene.hpp"
#include "validate/setup.hpp"

namespace fathom::validate {

struct Hashes {
  std::uint64_t state = 0;   ///< World::state_hash
  std::uint64_t events = 0;  ///< of all contacts begun and ended, in order
  friend bool operator==(Hashes, Hashes) = default;
};

struct Golden {
  const char* environment;  ///< or `columns`, or `stream`
  std::int64_t bodies;
  int steps;
  Solver solver;
  BroadPhase broad_phase;
  /// For the native simulator, and for the device simulator on every back end: they order contacts differently.
  Hashes native, device;

  const Hashes& of(SimulatorKind simulator) const { return simulator == SimulatorKind::native ? native : device; }
};

std::span<const Golden> goldens();

/// Runs the environment of a golden state from its start.
Hashes run_golden(const Golden& golden, const Setup& setup);

}  // namespace fathom::validate
