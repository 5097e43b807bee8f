// A pair of bodies whose boxes overlap, and the manifold it has while they touch.
//
// Two structures, because many pairs never touch: the narrow phase looks at every contact in every step, and
// constraint building transposes manifolds into vector lanes, which is why they are made of 16-byte quads.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

#include "collision/manifold.hpp"

namespace fathom::native {

inline constexpr std::uint32_t none = 0xffffffffu;
inline constexpr std::uint8_t no_colour = 0xff;

struct Contact {
  std::uint32_t a = none, b = none;  ///< slots; a body that cannot be pushed is always A
  std::uint32_t manifold = none;     ///< while touching
  AxisCache axis;
  std::uint32_t next[2] = {none, none};  ///< further contacts of A and of B; the low bit tells which side
  std::uint32_t previous[2] = {none, none};
  std::uint32_t colour_slot = 0;  ///< place in its colour's list
  float recycle_distance = 0;     ///< m that the bodies may move against each other before the manifold is made anew
  std::uint8_t colour = no_colour;
  bool fixed_a = false;  ///< A is fixed or kinematic
  bool in_use = false;   ///< the slot holds a pair

  bool touching() const { return manifold != none; }
};
static_assert(sizeof(Contact) == 44);

/// Anchors of a contact point, two quads; the fourth elements of B's hold what else the manifold must remember.
struct ContactPointState {
  Vec3 anchor_a;  ///< in A's frame (m)
  std::uint32_t feature = 0;
  Vec3 anchor_b;  ///< in B's frame (m)
  float other = 0;
};

struct alignas(16) ContactManifold {
  Vec3 normal;  ///< in A's frame, from A to B
  float friction = 0;
  Vec3 tangent;  ///< in A's frame
  float restitution = 0;
  float impulses[max_manifold_points] = {};  ///< along the normal, over the last substep (N·s)
  float friction_impulse[2] = {0, 0};        ///< along tangent and normal × tangent (N·s)
  float twist_impulse = 0;                   ///< about the normal (N·m·s)
  float unused = 0;
  ContactPointState points[max_manifold_points];
  Quat rotation_at_build;  ///< B in A's frame when the points were made

  // B's position in A's frame when the points were made, and the number of points.
  Vec3 position_at_build() const { return {points[0].other, points[1].other, points[2].other}; }
  int point_count() const { return static_cast<int>(points[3].other); }
  void set_build(const Pose& b_in_a, int count) {
    rotation_at_build = b_in_a.rotation;
    points[0].other = b_in_a.position.x;
    points[1].other = b_in_a.position.y;
    points[2].other = b_in_a.position.z;
    points[3].other = static_cast<float>(count);
  }
};
static_assert(sizeof(ContactManifold) == 208);

}  // namespace fathom::native
