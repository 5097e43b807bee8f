// A pair of bodies whose boxes overlap, with all that is kept of it from step to step.
//
// Four cache lines: the first is all that the narrow phase reads of a pair at rest or apart, the others are
// what constraint building transposes into vector lanes, which is why they are made of 16-byte quads.
#pragma once

#include <cstdint>

#include <fathom/math.hpp>

#include "collision/manifold.hpp"

namespace fathom::native {

inline constexpr std::uint32_t none = 0xffffffffu;
inline constexpr std::uint8_t no_colour = 0xff;

struct ContactPointState {
  Vec3 anchor_a;  ///< in A's frame (m)
  float impulse = 0;  ///< along the normal, over the last substep (N·s)
  Vec3 anchor_b;  ///< in B's frame (m)
  std::uint32_t feature = 0;
};

struct alignas(64) Contact {
  // --- line 0: read every step
  std::uint32_t a = none, b = none;  ///< slots; a body that cannot be pushed is always A
  Quat rotation_at_build;            ///< B in A's frame when the manifold was made
  Vec3 position_at_build;
  AxisCache axis;
  std::uint8_t point_count = 0;  ///< 0: not touching
  std::uint8_t colour = no_colour;
  bool fixed_a = false;   ///< A is fixed or kinematic
  bool in_use = false;    ///< the slot holds a pair
  std::uint32_t colour_slot = 0;  ///< place in its colour's list
  std::uint32_t next[2] = {none, none};  ///< further contacts of A and of B; the low bit tells which side
  std::uint32_t previous[2] = {none, none};

  // --- line 1
  Vec3 normal;  ///< in A's frame, from A to B
  float friction = 0;
  Vec3 tangent;  ///< in A's frame
  float restitution = 0;
  float friction_impulse[2] = {0, 0};  ///< along tangent and normal × tangent (N·s)
  float twist_impulse = 0;             ///< about the normal (N·m·s)
  float approach_speed = 0;            ///< when the bodies began to touch (m/s)
  float unused[4] = {};

  // --- lines 2 and 3
  ContactPointState points[max_manifold_points];
};
static_assert(sizeof(Contact) == 256);

}  // namespace fathom::native
