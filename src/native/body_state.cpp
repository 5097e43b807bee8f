#include "native/body_state.hpp"

#include "geometry/support.hpp"
#include "native/contact.hpp"
#include "world/growth.hpp"

namespace fathom::native {

template <class Act>
void BodyState::for_each_array(const Act& act) {
  act(poses, 0), act(velocities, 0), act(boxes, 0), act(fat_boxes, 0), act(flags, 0), act(slow_time, 0);
  act(first_contact, 0), act(colour_mask, 0), act(overflow_count, 0), act(forces, 0);
  act(solver, 1), act(motion, 0), act(warm, 0), act(inertia, 0);
}

void BodyState::resize(std::size_t slots) {
  for_each_array([&](auto& array, std::size_t extra) { grow_to(array, slots + extra); });
}

void BodyState::reserve(std::size_t slots) {
  for_each_array([&](auto& array, std::size_t extra) { array.reserve(slots + extra); });
}

void BodyState::clear(std::uint32_t slot) {
  for_each_array([&](auto& array, std::size_t extra) { array[slot + extra] = {}; });
  first_contact[slot] = none;
}

std::size_t BodyState::memory_bytes() const {
  std::size_t sum = 0;
  const_cast<BodyState*>(this)->for_each_array(
      [&](const auto& array, std::size_t) { sum += array.capacity() * sizeof(array[0]); });
  return sum;
}

Aabb motion_box(const BodyInfo& info, const Pose& pose, const Velocity& velocity, float dt) {
  Aabb box = bounds(info.geometry, pose);
  // Turning moves a point by at most the angle times its distance, and never beyond the bounding sphere.
  const float turning = min(length(velocity.angular) * dt, 1.0f) * info.radius;
  box = grown(box, half_speculative_margin + turning);
  const Vec3 path = dt * velocity.linear;
  return {box.lower + min(path, Vec3{}), box.upper + max(path, Vec3{})};
}

Aabb fat_box(const BodyInfo& info, const Aabb& box, Vec3 velocity, float dt) {
  // 3 cm: bodies set 10 cm apart are no pairs. Movers get eight steps' way ahead, but no more than a quarter of their
  // size, because every step of it costs pairs that never touch.
  constexpr float margin = 0.03f;
  constexpr float steps_ahead = 8.0f;
  const float reach = 0.25f * info.radius;
  const Vec3 limit{reach, reach, reach};
  const Vec3 ahead = max(-limit, min((steps_ahead * dt) * velocity, limit));
  const Aabb roomy = grown(box, min(margin, 0.1f * info.radius));
  return {roomy.lower + min(ahead, Vec3{}), roomy.upper + max(ahead, Vec3{})};
}

}  // namespace fathom::native
