// Results of a run of the campaign.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "case.hpp"
#include "measure/statistics.hpp"
#include "scene/quality.hpp"

namespace fathom::campaign {

/// One step (ms; counts of the step).
struct Sample {
  std::uint64_t step = 0;  ///< from 1
  double total = 0;  ///< wall time; on a device from the end of the previous step to the end of this one, on its clock
  double broad_phase = 0, narrow_phase = 0, collision_resolution = 0;
  std::uint32_t pairs = 0, manifolds = 0, points = 0;
};

struct QualitySample {
  std::uint64_t step = 0;
  Quality quality;
};

/// ms over all samples.
struct StageStatistics {
  Statistics total, broad_phase, narrow_phase, collision_resolution;
};

/// How far individual steps stand out: step over the median of the 61 steps around it, without the first second
/// (start-up).
struct Spikes {
  double p99 = 1, max = 1;
};

/// Summary of a run's samples.
struct Summary {
  StageStatistics stages;
  Spikes spikes;
  std::vector<double> blocks;  ///< median step (ms) of every 60 steps, for comparisons
};
Summary summarise(const std::vector<Sample>& samples);

struct Measurement {
  Case what;
  std::string hardware;  ///< what it ran on
  std::uint64_t bodies = 0;
  std::uint64_t steps = 0;      ///< made
  std::vector<Sample> samples;  ///< one per step
  Summary summary;
  std::vector<QualitySample> quality;  ///< every few seconds, the last at the end
  double wall_seconds = 0;             ///< for all steps
  std::uint64_t interruptions = 0;     ///< by other programs that wanted the processor
  std::uint64_t memory_bytes = 0;      ///< held by the simulator
  std::string hash;                    ///< of the last state
  std::string skipped;                 ///< why there was no run, or it has no figures
  std::string refused;                 ///< why its figures are not reported: states not finite, exploded
  std::string failing;                 ///< what is wrong with a run whose figures are reported nevertheless
  bool cut_short = false;              ///< by the limit on a run's time

  bool reported() const { return skipped.empty() && refused.empty(); }
  const Quality& end() const { return quality.back().quality; }
};

}  // namespace fathom::campaign
