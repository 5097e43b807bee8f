// Executes one run of the campaign.
#pragma once

#include <functional>
#include <optional>

#include "measurement.hpp"

namespace fathom::campaign {

struct RunLimits {
  std::uint64_t steps = published_steps;
  double seconds = 1e9;  ///< of wall time, after which a run is cut short
};

/// Called before the first step, with 0, and after each step; false ends the run.
using StepObserver = std::function<bool(std::uint64_t step, const World& world)>;

/// The finished run, or nothing if the observer ended it. Features that the simulator lacks are reported as `skipped`.
std::optional<Measurement> run_case(const Case& what, const RunLimits& limits, const StepObserver& observe);

/// Why the figures of such states are not reported (not finite, more energy than at the start), or empty.
std::string refusal(const Scene& scene, const Quality& quality, std::uint64_t steps);

}  // namespace fathom::campaign
