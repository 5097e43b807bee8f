// One engine, one scene, once.
#pragma once

#include "engine.hpp"
#include "measure/statistics.hpp"
#include "scene/quality.hpp"

namespace fathom::peers {

struct Measurement {
  Statistics step_ms;
  Quality quality;
  int steps = 0;           ///< made
  bool cut_short = false;  ///< by the limit on a run's time
  std::string trouble;     ///< why the run does not count; empty where it does
};

/// Only the steps are timed, the first one too; not the scene's kicks. A run whose steps have taken more than `limit`
/// seconds ends there, and one that is interrupted (`InterruptGuard`), which then tells nothing. What an engine cannot
/// do comes back as `trouble`.
Measurement measure(const EngineKind& kind, const Scene& scene, int threads, int steps, double limit);

}  // namespace fathom::peers
