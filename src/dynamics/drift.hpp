// How bodies that cannot be pushed move against each other during a step (collision/seam.hpp). Pure, for host and
// device.
#pragma once

#include "dynamics/time_of_impact.hpp"

namespace fathom {

/// Whether two bodies stay where they are to each other, as far as their velocities tell without rounding.
FATHOM_HD bool stay_together(const Velocity& a, const Velocity& b) {
  constexpr Vec3 none{};
  return a.linear == b.linear && a.angular == none && b.angular == none;
}

/// Around what is in the box in a body's frame, in world axes, as the body is taken from one pose to the other.
FATHOM_HD Aabb bounds_of_way(const Aabb& box, const Pose& from, const Pose& to) {
  const Aabb first = bounds(box, from), last = bounds(box, to);
  return {min(first.lower, last.lower), max(first.upper, last.upper)};
}

}  // namespace fathom
