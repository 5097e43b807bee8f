// Ground made by rule: heights over the plane, the same on every machine.
#pragma once

#include <cstdint>

namespace fathom {

/// Swell: three trains of waves in random directions.
struct Waves {
  double height = 1;       ///< m, heights are within ± half of it
  double length = 10;      ///< m from crest to crest of the longest train
  std::uint64_t seed = 1;  ///< other directions

  /// Height (m) over the point (m).
  double at(double x, double y) const;
};

/// Random hills with smaller ones on them, each half as wide.
struct Hills {
  double height = 1;       ///< m, heights are within ± half of it
  double length = 10;      ///< m, width of the largest
  double roughness = 0.5;  ///< height of the next smaller ones, of the larger ones'
  int layers = 4;          ///< how many sizes there are
  std::uint64_t seed = 1;  ///< other hills

  double at(double x, double y) const;
};

}  // namespace fathom
