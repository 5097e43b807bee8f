// State hashes that every build on every machine must give: the environments after some steps.
#pragma once

#include <cstdint>
#include <span>

#include "scene/scene.hpp"
#include "validate/setup.hpp"

namespace fathom::validate {

struct Golden {
  const char* environment;
  std::int64_t bodies;
  int steps;
  Solver solver;
  BroadPhase broad_phase;
  std::uint64_t state;   ///< World::state_hash
  std::uint64_t events;  ///< of all contacts begun and ended, in their order
};

std::span<const Golden> goldens();

struct Hashes {
  std::uint64_t state = 0, events = 0;
  friend bool operator==(Hashes, Hashes) = default;
};

/// Runs the environment of a golden state from its beginning.
Hashes run_golden(const Golden& golden, const Setup& setup);

}  // namespace fathom::validate
