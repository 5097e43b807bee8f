// Every engine on every scene, several times.
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

/// `pyramid` takes its size in layers, the others in bodies. Throws `invalid_argument` for anything else.
SceneEntry parse_scene_entry(const std::string& text, int default_steps);

struct Result {
  const SceneEntry* scene;
  const EngineKind* engine;
  int threads;                      ///< actually used
  std::vector<Measurement> rounds;  ///< one per round

  double mean_ms() const;    ///< the median of the rounds' means
  double median_ms() const;  ///< … of their medians, and so on
  double p99_ms() const;
  double max_ms() const;
  const Quality& quality() const { return rounds.back().quality; }
  /// The trouble of the first round that had any.
  std::string trouble() const;
};

/// Called before each run with the number of the round, from 1.
using Progress = std::function<void(int round, const Result& next)>;

/// Results by scene, then by number of threads, with the engines in the given order. In a round the engines alternate
/// on a scene: a slow minute of the machine affects them all. Engines without threads run once per round, on one
/// thread. `limit` (s) is that of `measure`; a run that gave no figures is not repeated. An `InterruptGuard` ends the
/// campaign early, with the results so far.
std::vector<Result> run_campaign(const std::vector<SceneEntry>& scenes, const std::vector<const EngineKind*>& engines,
                                 const std::vector<int>& threads, int rounds, double limit, const Progress& progress);

}  // namespace fathom::peers
