// The boxes that a broad phase keeps of a body. Pure, for host and device.
#pragma once

#include "geometry/support.hpp"

namespace fathom {

/// How far (m) something comes within a step of `dt` that its weight sets in motion at its beginning, at most.
FATHOM_HD float fall_within(float dt) { return 9.81f * dt * dt; }

/// Half the distance (m) at which bodies as large as one with bounding radius `radius` (m) become a contact although
/// they do not touch yet: speculative margin. 1 cm from a radius of some 17 cm on (at 1/60 s). In a heap of pebbles
/// dozens of others are within that of each: they have a twentieth of their size, and, as a pair, what one may fall
/// before contacts are looked for again.
FATHOM_HD float half_speculative_margin(float radius, float dt) {
  return min(0.01f, 0.05f * radius + 0.5f * fall_within(dt));
}

/// Box of everything the shape with bounding radius `radius` (m) may reach within `dt`, plus half the speculative
/// margin.
FATHOM_HD Aabb motion_box(const Geometry& shape, float radius, const Pose& pose, const Velocity& velocity, float dt) {
  Aabb box = bounds(shape, pose);
  // Turning moves a point by at most the angle times its distance, and never beyond the bounding sphere.
  const float turning = min(length(velocity.angular) * dt, 1.0f) * radius;
  box = grown(box, half_speculative_margin(radius, dt) + turning);
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
