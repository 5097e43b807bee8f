// The native simulator's data of a joint, in addition to the JointTable's.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

#include "dynamics/ball_joint.hpp"
#include "native/contact.hpp"

namespace fathom::native {

struct Joint {
  std::uint32_t a = none, b = none;  ///< slots; a body that cannot be pushed is always A
  Vec3 anchor_a, anchor_b;           ///< m, body axes
  JointSoftness softness;
  float max_impulse = 0;  ///< N·s per substep, of a spring; 0 for a rigid joint
  float max_start = 0;    ///< N·s, limit of warm-starting impulses at the start of a step
  std::uint8_t colour = no_colour;
  bool fixed_a = false;  ///< A is fixed or kinematic
  bool in_use = false;
  bool rigid = false;  ///< as stiff as possible
  ConstraintKind kind = ConstraintKind::ball_joint;
  std::uint8_t unused[3] = {};
};
static_assert(sizeof(Joint) == 64);  // without padding, which snapshots would hold

/// What outlasts a step (N·s on B, world axes).
struct JointImpulse {
  Vec3 last;   ///< of the last substep, to start from
  Vec3 total;  ///< of the whole step
};

}  // namespace fathom::native
