// The points of a patch on uneven ground that a body comes to rest on.
//
// On flat ground the largest patch is best (collision/reduce.hpp). On peaks of rough ground one point of the largest
// patch may touch while three are far above the ground: the body then tips onto peaks without contact points, sinks in,
// is pushed out, and never comes to rest.
#pragma once

#include "collision/reduce.hpp"

namespace fathom {

struct RestingPoints {
  int under_load = 0;  ///< at most 4
  int around = 0;      ///< at most 4
};

/// Moves the points to keep to the front and returns their number. `under_load`: the largest patch in one plane on
/// which the body comes to rest under the load at `load`; if it has only three points, also the point that the body
/// first meets as it tips over its nearest side. `around`: the largest patch of the points above that plane, because
/// other loads may press the body anywhere. `depth_tie`: points within this height (m) above the plane count as in it.
RestingPoints choose_resting_points(FacePoint* points, int count, float depth_tie, FaceLoad load);

}  // namespace fathom
