// The tree of boxes over the parts of a mesh or a compound.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

namespace fathom {

/// Nodes lie in the order of depth first: an inner node's first child follows it.
struct BoxTreeNode {
  Vec3 lower;           ///< m, of its box
  std::uint32_t next;   ///< inner node: its second child; leaf: its first part
  Vec3 upper;           ///< m
  std::uint32_t count;  ///< of a leaf's parts; 0: inner node
};

}  // namespace fathom
