// The broad phase's boxes of a body. Pure, for host and device.
#pragma once

#include "dynamics/lane_scalar.hpp"
#include "dynamics/tuning.hpp"
#include "geometry/support.hpp"

namespace fathom {

/// Distance (m) that a body starting from rest may fall within a step of `dt` (s), at most.
FATHOM_HD float fall_within(float dt) { return 9.81f * dt * dt; }

#define FATHOM_LANE_FUNCTION FATHOM_HD
#include "dynamics/bounds-inl.hpp"
#undef FATHOM_LANE_FUNCTION

/// Box of everything that a shape with the bounds `tight` and the bounding radius `radius` (m) may reach within `dt`
/// (s), plus half the speculative margin.
FATHOM_HD Aabb motion_box(const Aabb& tight, float radius, const Velocity& velocity, float dt) {
  const Aabb box = grown(tight, reach_beyond_box(velocity.angular, radius, dt));
  const BoxOf<Vec3> all = swept(BoxOf<Vec3>{box.lower, box.upper}, dt * velocity.linear);
  return {all.lower, all.upper};
}
FATHOM_HD Aabb motion_box(const Geometry& shape, float radius, const Pose& pose, const Velocity& velocity, float dt) {
  return motion_box(bounds(shape, pose), radius, velocity, dt);
}

FATHOM_HD Aabb fat_box(float radius, const Aabb& box, Vec3 velocity, float dt) {
  const BoxOf<Vec3> fat = fat_box(radius, BoxOf<Vec3>{box.lower, box.upper}, velocity, dt);
  return {fat.lower, fat.upper};
}

}  // namespace fathom
