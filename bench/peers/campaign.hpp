// Every engine on every scene, several times over.
#pragma once

#include <functional>

#include "measure.hpp"

namespace fathom::peers {

/// A scene of the campaign, as written on the command line: environment:size or environment:size@steps.
struct SceneEntry {
  std::string name;  ///< environment:size
  Scene scene;
  int steps = 0;
};

/// The size of `pyramid` is in layers, of the others in bodies. Throws `invalid_argument` on anything else.
SceneEntry parse_scene_entry(const std::string& text, int default_steps);

struct Result {
  const SceneEntry* scene;
  const EngineKind* engine;
  int threads;                      ///< that it ran on
  std::vector<Measurement> rounds;  ///< one a round

  double mean_ms() const;    ///< the median of the rounds' means
  double median_ms() const;  ///< … of their medians, and so on
  double p99_ms() const;
  double max_ms() const;
  const Quality& quality() const { return rounds.back().quality; }
  /// Of the first round that went wrong.
  std::string trouble() const;
};

/// Called before each run with the number of the round, from 1.
using Progress = std::function<void(int round, const Result& next)>;

/// Results scene by scene, within a scene by number of threads, engines in the given order. In a round the
/// engines take turns on a scene, so that a slow minute of the machine meets them all. Engines without threads
/// run once a round, on one thread. `limit` (s) is that of `measure`; what took no figures once is not tried again. An
/// `InterruptGuard` ends it early, with what was measured.
std::vector<Result> run_campaign(const std::vector<SceneEntry>& scenes, const std::vector<const EngineKind*>& engines,
                                 const std::vector<int>& threads, int rounds, double limit, const Progress& progress);

}  // namespace fathom::peers
