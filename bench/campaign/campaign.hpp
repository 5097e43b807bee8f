// The campaign: chapter 4 of the dissertation, on any machine.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "plan.hpp"
#include "run_case.hpp"
#include "store.hpp"

namespace fathom::campaign {

struct Settings {
  Form form = Form::quick;
  std::vector<std::string> only;  ///< parts of keys; empty for all
  RunLimits limits;
  int rounds = 1;
  bool resume = false;
};

/// Progress of the campaign.
struct Progress {
  std::size_t run = 0, runs = 0;  ///< the current run, from 1, and their total
  const Case* what = nullptr;
  std::uint64_t step = 0, steps = 0;
  double seconds_left = 0;  ///< approximate
};

/// Called often; false interrupts the campaign.
using Observer = std::function<bool(const Progress&)>;

/// Makes the runs that are missing in the folder and saves each as it ends. Without `resume` the folder must not
/// contain a campaign; with it, it must contain one of the same build and machine. Throws `Error{file}` or
/// `Error{invalid_argument}` before anything runs. Returns whether all runs are complete.
bool run_campaign(const Store& store, const Settings& settings, const Observer& observe);

}  // namespace fathom::campaign
