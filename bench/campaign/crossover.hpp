// The number of bodies from which one simulator beats another.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "view.hpp"

namespace fathom::campaign {

/// Times (ms) of two simulators on a scene with this many bodies.
struct Duel {
  double bodies = 0, native = 0, device = 0;
};

struct Crossover {
  bool always = false;          ///< the device wins at every measured size
  bool never = false;           ///< at none
  double bodies = 0;            ///< otherwise: where the times are equal, interpolated geometrically between sizes
  double below = 0, above = 0;  ///< the measured sizes around it; the smallest or largest if `always` or `never`

  std::string text() const;
};
/// The last crossing from native to device for rising sizes; empty if nothing was measured.
std::optional<Crossover> crossover(const std::vector<Duel>& duels);

/// Device runs with one label against the fastest native run with the same set of algorithms, for a stage.
std::vector<Duel> duels(const View& view, const std::string& environment, const std::string& device_label,
                        const Stage& stage);
/// The same for published hardware against the published processor.
std::vector<Duel> published_duels(const std::string& environment, const std::string& hardware, const Stage& stage);

/// Labels of the runs that use a device.
std::vector<std::string> device_labels(const View& view);

}  // namespace fathom::campaign
