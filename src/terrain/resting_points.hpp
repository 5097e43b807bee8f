// The points of a patch on uneven ground that a body rests on.
//
// On flat ground the largest patch is the best (collision/reduce.hpp). On the peaks of rough ground one point of the
// largest may touch and three be far above the ground: the body then tips onto peaks that no point tells of, sinks in,
// is pushed out, and never comes to rest.
#pragma once

#include "collision/reduce.hpp"

namespace fathom {

struct RestingPoints {
  int under_load = 0;  ///< at most 4
  int around = 0;      ///< at most 4
};

/// Reorders the points so that those to keep come first, and returns how many there are. Under the load, which is at
/// `load`, the largest patch of those in one plane that the body comes to rest on, and where these are but three the
/// one that it meets first when it tips over its nearest side. Around them, of those above that plane, the largest
/// patch: what else presses the body may press it anywhere. `depth_tie`: points that much (m) above the plane count as
/// in it.
RestingPoints choose_resting_points(FacePoint* points, int count, float depth_tie, FaceLoad load);

}  // namespace fathom
