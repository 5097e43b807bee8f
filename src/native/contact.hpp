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
  std::uint8_t colour = no_colour;
  bool fixed_a = false;  ///< A is fixed or kinematic
  bool in_use = false;   ///< the slot holds a pair

  bool touching() const { return manifold != none; }
};
static_assert(sizeof(Contact) == 40);

struct ContactPointState {
  Vec3 anchor_a;      ///< in A's frame (m)
  float impulse = 0;  ///< along the normal, over the last substep (N·s)
  Vec3 anchor_b;      ///< in B's frame (m)
  std::uint32_t feature = 0;
};

struct alignas(16) ContactManifold {
  Vec3 normal;  ///< in A's frame, from A to B
  float friction = 0;
  Vec3 tangent;  ///< in A's frame
  float restitution = 0;
  float friction_impulse[2] = {0, 0};  ///< along tangent and normal × tangent (N·s)
  float twist_impulse = 0;             ///< about the normal (N·m·s)
  std::uint32_t point_count = 0;
  ContactPointState points[max_manifold_points];
  Quat rotation_at_build;  ///< B in A's frame when the points were made
  Vec3 position_at_build;
  float reserved = 0;
};
static_assert(sizeof(ContactManifold) == 208);

}  // namespace fathom::native
