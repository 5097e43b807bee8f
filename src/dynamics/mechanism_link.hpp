// What a mechanism (dynamics/mechanism.hpp) is made of: links, and their state in a step.
#pragma once

#include <cstdint>

#include "dynamics/ball_joint.hpp"
#include "dynamics/joint_link.hpp"
#include "dynamics/joint_tree.hpp"
#include "dynamics/tuning.hpp"

namespace fathom {

/// A body of a tree, and the joint to its parent. Links are numbered across all trees; those of one follow each other
/// level by level, and so do the children of a link.
struct MechanismLink {
  static constexpr std::uint32_t none = 0xffffffffu;

  std::uint32_t body;
  std::uint32_t joint;     ///< none: the root of a tree that hangs on nothing
  std::uint32_t parent;    ///< link, or none where that is an obstacle
  std::uint32_t obstacle;  ///< body, or none where the parent is a link
  std::uint32_t generic;   ///< number of its JointLink, or none: a ball joint, or no joint
  std::uint32_t first_child, children;
  std::uint32_t is_b;  ///< 1: the body is the joint's B
  std::uint32_t mechanism;
  float rigid_mass;                ///< kg, of all that moves as one with the body, itself among it
  std::uint32_t original = none;   ///< of a copy: the link that it is a copy of
  std::uint32_t next_copy = none;  ///< a link
  std::uint32_t copies = 0;        ///< of the link

  /// How inert the body has to be where it touches something, in parts of its own: what moves with it, contacts don't
  /// know.
  FATHOM_HD float min_inertia(float inverse_mass) const {
    return max(rigid_mass * inverse_mass * (1 / max_behind_a_contact), 1.0f);
  }
  FATHOM_HD std::uint32_t end_of_children() const { return first_child + children; }
  FATHOM_HD bool is_copy() const { return original != none; }
  /// Of the mechanism, at the body.
  FATHOM_HD std::uint32_t joints() const { return children + (joint != none ? 1 : 0) + copies; }
};

struct Mechanism {
  std::uint32_t first, end;     ///< links
  std::uint32_t level, levels;  ///< of the list of levels, each a first link: the first entry, and how many follow it
  std::uint32_t closures = 0;   ///< copies, listed behind the end of the levels
  std::uint32_t closure_memory = 0;  ///< where that of its LoopClosure begins (floats)

  FATHOM_HD std::uint32_t first_closure() const { return level + levels + 1; }
};

#define FATHOM_LANE_FUNCTION FATHOM_HD
#include "dynamics/link_state-inl.hpp"
#undef FATHOM_LANE_FUNCTION

}  // namespace fathom
