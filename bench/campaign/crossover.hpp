// From how many bodies one simulator beats another.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "view.hpp"

namespace fathom::campaign {

/// Times (ms) of two simulators on a scene with so many bodies.
struct Duel {
  double bodies = 0, native = 0, device = 0;
};

struct Crossover {
  bool always = false;          ///< at every size measured
  bool never = false;           ///< at none
  double bodies = 0;            ///< else: where the times are equal, interpolated between sizes in proportions
  double below = 0, above = 0;  ///< the sizes measured around it; `always` and `never` have the least and the largest

  std::string text() const;
};
/// The last crossing from native to device over rising sizes; none where nothing was measured.
std::optional<Crossover> crossover(const std::vector<Duel>& duels);

/// Device runs of one label against the fastest native run of the same set of algorithms, on a stage.
std::vector<Duel> duels(const View& view, const std::string& environment, const std::string& device_label,
                        const Stage& stage);
/// The same of published hardware against the published processor.
std::vector<Duel> published_duels(const std::string& environment, const std::string& hardware, const Stage& stage);

/// Labels of the runs that use a device.
std::vector<std::string> device_labels(const View& view);

}  // namespace fathom::campaign
