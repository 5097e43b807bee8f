// The boxes that a broad phase keeps of a body. Pure, for host and device.
#pragma once

#include "geometry/support.hpp"

namespace fathom {

/// Half the distance at which two bodies become a contact although they do not touch yet (m): speculative margin.
inline constexpr float half_speculative_margin = 0.01f;

/// Box of everything the shape with bounding radius `radius` (m) may reach within `dt`, plus half the speculative
/// margin.
FATHOM_HD Aabb motion_box(const Geometry& shape, float radius, const Pose& pose, const Velocity& velocity, float dt) {
  Aabb box = bounds(shape, pose);
  // Turning moves a point by at most the angle times its distance, and never beyond the bounding sphere.
  const float turning = min(length(velocity.angular) * dt, 1.0f) * radius;
  box = grown(box, half_speculative_margin + turning);
  const Vec3 path = dt * velocity.linear;
  return {box.lower + min(path, Vec3{}), box.upper + max(path, Vec3{})};
}

/// `box` with room for several steps of motion, so that the broad phase hears of a body only now and then.
FATHOM_HD Aabb fat_box(float radius, const Aabb& box, Vec3 velocity, float dt) {
  // 3 cm: bodies set 10 cm apart are no pairs. Movers get eight steps' way ahead, but no more than a quarter of their
  // size, because every step of it costs pairs that never touch.
  constexpr float margin = 0.03f;
  constexpr float steps_ahead = 8.0f;
  const float reach = 0.25f * radius;
  const Vec3 limit{reach, reach, reach};
  const Vec3 ahead = max(-limit, min((steps_ahead * dt) * velocity, limit));
  const Aabb roomy = grown(box, min(margin, 0.1f * radius));
  return {roomy.lower + min(ahead, Vec3{}), roomy.upper + max(ahead, Vec3{})};
}

}  // namespace fathom
