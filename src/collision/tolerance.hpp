// Lengths that the narrow phase ignores, in one file: all paths must agree.
//
// For everyday sizes they are fractions of the solver's linear slop (5 mm). They shrink with small shapes: a tolerance
// never exceeds the pebble it is applied to.
#pragma once

#include <fathom/math.hpp>

namespace fathom {

/// How `collide` breaks ties between features of a pair.
struct Tolerance {
  float axis = 0;       ///< m by which another axis must beat the preferred one
  float side = 0;       ///< m beyond a reference face's side at which a point still counts as inside
  float depth_tie = 0;  ///< m within which two points are equally deep
  float noise = 0;      ///< m, expected rounding error of a separation along an unnormalised axis
};

/// m, and share of the smallest half width, of `Tolerance::axis`; and the rounding errors of it and of a separation, as
/// shares of the reach.
inline constexpr float max_axis_tolerance = 0.0025f, axis_tolerance_share = 0.05f;
inline constexpr float axis_rounding = 1e-6f, separation_rounding = 2e-7f;

/// `smallest`: least half width of the two shapes; `reach`: bound on the coordinates that enter a separation.
FATHOM_HD Tolerance make_tolerance(float smallest, float reach) {
  const float axis = min(max_axis_tolerance, axis_tolerance_share * smallest) + axis_rounding * reach;
  return {axis, 0.2f * axis, 0.1f * axis, separation_rounding * reach};
}

}  // namespace fathom
