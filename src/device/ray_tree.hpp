// The host's search tree of bodies (native/bvh.hpp) on the device, and a ray's way through it.
//
// Like `Bvh::visit`, but eight boxes are tested one after the other. What is missed or found in excess does not matter
// to the answer as long as no box that the ray meets is missed: rounding is allowed for as there.
#pragma once

#include <cstdint>
#include <fathom/query.hpp>

#include "native/bvh.hpp"

namespace fathom::device {

/// A hierarchy in device memory. Level 0 holds the leaves' parents; the root is alone in the last.
struct RayTree {
  static constexpr std::uint32_t max_levels = 11;      // 8^11 leaves are more than 32 bits can number
  static constexpr std::uint32_t nobody = 0xffffffff;  ///< in leaves that do not count
  const native::Bvh::Node* nodes = nullptr;
  const std::uint32_t* leaves = nullptr;  ///< body slots, or `nobody`
  std::uint32_t leaf_count = 0;
  std::uint32_t level_count = 0;                                 ///< 0: the tree is empty
  std::uint32_t first[max_levels] = {}, count[max_levels] = {};  ///< nodes of each level

  /// Children on the level below.
  FATHOM_HD std::uint32_t children_below(std::uint32_t level) const {
    return level > 0 ? count[level - 1] : leaf_count;
  }
};

/// A ray against boxes by slabs (T. Kay, J. Kajiya, "Ray Tracing Complex Scenes", 1986).
class RaySlabs {
 public:
  static constexpr float coordinate_rounding = 0x1p-21f, fraction_rounding = 1 + 0x1p-20f;

  FATHOM_HD explicit RaySlabs(const Ray& ray) {
    for (int axis = 0; axis < 3; ++axis) {
      constexpr float smallest = 1e-20f;  // m; an axis without motion moves by this
      const float way = ray.translation[axis];
      origin_[axis] = ray.origin[axis];
      per_way_[axis] = 1 / (way >= 0 ? max(way, smallest) : min(way, -smallest));
      rounding_[axis] = coordinate_rounding * abs(ray.origin[axis]);
    }
  }

  /// Whether the ray meets a node's child up to the fraction `limit`; `enter` says where.
  FATHOM_HD bool meets(const native::Bvh::Node& node, std::uint32_t child, float limit, float& enter) const {
    float leave = limit;
    enter = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const float lower = node.lower[axis][child], upper = node.upper[axis][child];
      const float room = rounding_[axis] + coordinate_rounding * max(abs(lower), abs(upper));
      const float a = (lower - room - origin_[axis]) * per_way_[axis],
                  b = (upper + room - origin_[axis]) * per_way_[axis];
      enter = max(enter, min(a, b));
      leave = min(leave, max(a, b));
    }
    return enter <= leave * fraction_rounding;
  }

 private:
  float origin_[3], per_way_[3], rounding_[3];
};

/// Visits bodies whose boxes the ray meets up to the fraction `limit`, roughly in that order. limit = visit(slot) is
/// the fraction at which the search may stop. Returns the last limit.
template <class Visit>
FATHOM_HD float visit_along(const RayTree& tree, const RaySlabs& slabs, float limit, const Visit& visit) {
  constexpr std::uint32_t width = native::Bvh::width;
  struct Entry {
    float fraction;
    std::uint32_t level, node;  // a leaf if the level is 0, else node `node` of level `level` − 1
  };
  if (tree.level_count == 0) return limit;
  Entry stack[width * (RayTree::max_levels + 1)];
  int top = 0;
  stack[top++] = {0, tree.level_count, 0};
  while (top > 0) {
    const Entry entry = stack[--top];
    if (entry.fraction > limit * RaySlabs::fraction_rounding) continue;
    if (entry.level == 0) {
      const std::uint32_t slot = tree.leaves[entry.node];
      if (slot != RayTree::nobody) limit = visit(slot);
      continue;
    }
    const std::uint32_t level = entry.level - 1, begin = width * entry.node, end = tree.children_below(level);
    const native::Bvh::Node& node = tree.nodes[tree.first[level] + entry.node];
    // The newest part of the stack is sorted, the nearest last.
    const int bottom = top;
    for (std::uint32_t c = 0; c < width && begin + c < end; ++c) {
      float fraction;
      if (!slabs.meets(node, c, limit, fraction)) continue;
      int place = top++;
      for (; place > bottom && stack[place - 1].fraction < fraction; --place) stack[place] = stack[place - 1];
      stack[place] = {fraction, level, begin + c};
    }
  }
  return limit;
}

}  // namespace fathom::device
