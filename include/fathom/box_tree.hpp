// The bounding-box tree over the parts of a mesh or a compound.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

namespace fathom {

/// Nodes are in depth-first order: an inner node's first child directly follows it.
struct BoxTreeNode {
  Vec3 lower;           ///< m
  std::uint32_t next;   ///< inner node: its second child; leaf: its first part
  Vec3 upper;           ///< m
  std::uint32_t count;  ///< number of a leaf's parts; 0: inner node
};

}  // namespace fathom
