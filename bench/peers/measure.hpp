// One run of one engine on one scene.
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
  std::string trouble;     ///< why the run does not count; empty if it does
};

/// Times only the steps, including the first, not the scene's kicks. A run ends early once its steps have taken more
/// than `limit` seconds, or when interrupted (`InterruptGuard`), which makes it meaningless. Scenes that an engine does
/// not support are reported as `trouble`.
Measurement measure(const EngineKind& kind, const Scene& scene, int threads, int steps, double limit);

}  // namespace fathom::peers
