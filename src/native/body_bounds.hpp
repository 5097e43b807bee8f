// A body's position and extent: what the broad phase and the narrow phase read first.
#pragma once

#include "dynamics/bounds.hpp"
#include "world/body_table.hpp"

namespace fathom::native {

/// One cache line, because contacts visit bodies in random order, where cost is mostly the number of lines fetched.
/// Half extents and radius are copies of BodyInfo's, so that separating two boxes need not fetch that as well.
struct alignas(64) BodyBounds {
  Aabb box;           ///< bounds of the next step's motion plus the speculative margin
  Aabb fat_box;       ///< the box with a margin to move in; what the broad phase sees
  Vec3 half_extents;  ///< of a box (m); other shapes have zero
  float radius = 0;   ///< of the bounding sphere (m)

  bool is_box() const { return half_extents.x > 0; }
};
static_assert(sizeof(BodyBounds) == 64);

inline Aabb motion_box(const BodyInfo& info, const Pose& pose, const Velocity& velocity, float dt) {
  return fathom::motion_box(info.geometry, info.radius, pose, velocity, dt);
}
inline Aabb fat_box(const BodyInfo& info, const Aabb& box, Vec3 velocity, float dt) {
  return fathom::fat_box(info.radius, box, velocity, dt);
}

inline void copy_shape(const BodyInfo& info, BodyBounds& to) {
  to.half_extents = info.geometry.type == ShapeType::box ? info.geometry.half_extents : Vec3{};
  to.radius = info.radius;
}

/// Bounds of a body at the start of such a motion.
inline BodyBounds bounds_of(const BodyInfo& info, const Pose& pose, const Velocity& velocity, float dt) {
  BodyBounds b;
  b.box = motion_box(info, pose, velocity, dt);
  b.fat_box = fat_box(info, b.box, velocity.linear, dt);
  copy_shape(info, b);
  return b;
}

}  // namespace fathom::native
