// Procedural ground: heights over the plane, the same on every machine.
#pragma once

#include <cstdint>

namespace fathom {

/// Swell: three wave trains in random directions.
struct Waves {
  double height = 1;       ///< m, heights are within ± half of it
  double length = 10;      ///< m from crest to crest of the longest train
  std::uint64_t seed = 1;  ///< determines the directions

  /// Height (m) at the point (m).
  double at(double x, double y) const;
};

/// Random hills with smaller ones on them, each half as wide.
struct Hills {
  double height = 1;       ///< m, heights are within ± half of it
  double length = 10;      ///< m, width of the largest
  double roughness = 0.5;  ///< height of each smaller size relative to the larger
  int layers = 4;          ///< number of sizes
  std::uint64_t seed = 1;  ///< determines the hills

  double at(double x, double y) const;
};

}  // namespace fathom
