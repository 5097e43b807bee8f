// One engine, one scene, once.
#pragma once

#include "engine.hpp"
#include "scene/quality.hpp"
#include "measure/statistics.hpp"

namespace fathom::peers {

struct Measurement {
  Statistics step_ms;
  Quality quality;
  std::string trouble;  ///< why the run does not count; empty where it does
};

/// Only the steps are timed, the first one too; not the scene's kicks.
Measurement measure(const EngineKind& kind, const Scene& scene, int threads, int steps);

}  // namespace fathom::peers
