// Runs a scene and measures it.
#pragma once

#include <cstdint>
#include <fathom/profile.hpp>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "run_files.hpp"
#include "scene/quality.hpp"
#include "scene/scene.hpp"

namespace fathom::cli {

/// Measurements, with one value per step in the series (ms).
struct RunResult {
  std::vector<double> step;
  std::vector<double> broad_phase;
  std::vector<double> narrow_phase;
  std::vector<double> collision_resolution;
  Profile last;
  Quality quality;
  std::uint64_t state_hash = 0;
  std::string hardware;  ///< of the device simulator
  bool interrupted = false;
};

/// Called after each step with its wall time (ms).
using StepObserver = std::function<void(const Profile& profile, double step_ms)>;

/// Runs the scene for `steps` steps, or until the caller's `InterruptGuard` requests an end.
RunResult simulate(const Scene& scene, std::uint64_t steps, const RunFileSettings& files, const StepObserver& observe);

}  // namespace fathom::cli
