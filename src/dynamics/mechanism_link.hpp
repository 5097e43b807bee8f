// The links of a mechanism (dynamics/mechanism.hpp) and their state in a step.
#pragma once

#include <cstdint>

#include "dynamics/ball_joint.hpp"
#include "dynamics/joint_link.hpp"
#include "dynamics/joint_tree.hpp"
#include "dynamics/tuning.hpp"

namespace fathom {

/// A body of a tree, and the joint to its parent. Links are numbered across all trees; those of one tree are
/// contiguous, level by level, and so are the children of a link.
struct MechanismLink {
  static constexpr std::uint32_t none = 0xffffffffu;

  std::uint32_t body;
  std::uint32_t joint;     ///< none: the root of a free tree
  std::uint32_t parent;    ///< link, or none where that is an obstacle
  std::uint32_t obstacle;  ///< body, or none where the parent is a link
  std::uint32_t generic;   ///< number of its JointLink, or none: a ball joint, or no joint
  std::uint32_t first_child, children;
  std::uint32_t is_b;  ///< 1: the body is the joint's B
  std::uint32_t mechanism;
  float rigid_mass;                ///< kg, of everything that moves as one with the body, including itself
  std::uint32_t original = none;   ///< for a copy: the link it copies
  std::uint32_t next_copy = none;  ///< a link
  std::uint32_t copies = 0;        ///< number of copies of the link
  std::uint32_t is_welded = 0;     ///< 1: a joint without any freedom connects the body to another one of the mechanism

  /// Minimum inertia of the body where it touches something, as a factor on its own: contacts do not know what moves
  /// with it.
  FATHOM_HD float min_inertia(float inverse_mass) const {
    return max(rigid_mass * inverse_mass * (1 / max_behind_a_contact), 1.0f);
  }
  FATHOM_HD std::uint32_t end_of_children() const { return first_child + children; }
  FATHOM_HD bool is_copy() const { return original != none; }
  /// Number of the mechanism's joints at the body.
  FATHOM_HD std::uint32_t joints() const { return children + (joint != none ? 1 : 0) + copies; }
};

struct Mechanism {
  std::uint32_t first, end;          ///< links
  std::uint32_t level, levels;       ///< in the list of levels, each a first link: first entry and number of levels
  std::uint32_t closures = 0;        ///< number of copies, which are listed after the levels
  std::uint32_t closure_memory = 0;  ///< offset of its LoopClosure's memory (floats)
  float mass = 0;                    ///< kg, of its bodies

  FATHOM_HD std::uint32_t first_closure() const { return level + levels + 1; }
};

#define FATHOM_LANE_FUNCTION FATHOM_HD
#include "dynamics/link_state-inl.hpp"
#undef FATHOM_LANE_FUNCTION

}  // namespace fathom
