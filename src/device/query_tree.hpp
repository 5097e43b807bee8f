// The host's search tree of bodies (native/bvh.hpp) on the device, and a moving box's way through it.
//
// Like `Bvh::visit`, in plain loops. What is found in excess does not matter to the answer as long as no box that the
// moving one meets is missed: rounding is allowed for as there.
#pragma once

#include <cstdint>

#include "exec/bits.hpp"
#include "native/bvh.hpp"
#include "world/body_visitor.hpp"

namespace fathom::device {

/// A hierarchy in device memory. Level 0 holds the leaves' parents; the root is alone in the last.
struct QueryTree {
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

/// A moving box against others by slabs (T. Kay, J. Kajiya, "Ray Tracing Complex Scenes", 1986). A ray's has no
/// extents.
class BoxSlabs {
 public:
  static constexpr float coordinate_rounding = 0x1p-21f, fraction_rounding = 1 + 0x1p-20f;

  FATHOM_HD explicit BoxSlabs(const MovingBox& box) {
    for (int axis = 0; axis < 3; ++axis) {
      constexpr float smallest = 1e-20f;  // m; an axis without motion moves by this
      const float way = box.translation[axis], half = box.half[axis];
      centre_[axis] = box.centre[axis];
      per_way_[axis] = 1 / (way >= 0 ? max(way, smallest) : min(way, -smallest));
      half_[axis] = half + coordinate_rounding * (half + abs(box.centre[axis]));
    }
  }

  /// Which of a node's children the box meets up to the fraction `limit`, a bit for each; `enter` says where. One
  /// loop over all children, which compilers for CPUs turn into vector instructions.
  FATHOM_HD std::uint32_t meets(const native::Bvh::Node& node, float limit, float* enter) const {
    std::uint32_t met = 0;
    for (std::uint32_t c = 0; c < native::Bvh::width; ++c) {
      float first = 0, last = limit;
      for (int axis = 0; axis < 3; ++axis) {
        const float lower = node.lower[axis][c], upper = node.upper[axis][c];
        const float room = half_[axis] + coordinate_rounding * max(abs(lower), abs(upper));
        const float a = (lower - room - centre_[axis]) * per_way_[axis],
                    b = (upper + room - centre_[axis]) * per_way_[axis];
        first = max(first, min(a, b));
        last = min(last, max(a, b));
      }
      enter[c] = first;
      met |= std::uint32_t{first <= last * fraction_rounding} << c;
    }
    return met;
  }

 private:
  float centre_[3], half_[3], per_way_[3];
};

/// Visits bodies whose boxes the moving one meets up to the fraction `limit`, roughly in that order. limit =
/// visit(slot) is the fraction at which the search may stop. Returns the last limit.
template <class Visit>
FATHOM_HD float visit_along(const QueryTree& tree, const BoxSlabs& slabs, float limit, const Visit& visit) {
  constexpr std::uint32_t width = native::Bvh::width;
  struct Entry {
    float fraction;
    std::uint32_t level, node;  // a leaf if the level is 0, else node `node` of level `level` − 1
  };
  if (tree.level_count == 0) return limit;
  Entry stack[width * (QueryTree::max_levels + 1)];
  int top = 0;
  stack[top++] = {0, tree.level_count, 0};
  while (top > 0) {
    const Entry entry = stack[--top];
    if (entry.fraction > limit * BoxSlabs::fraction_rounding) continue;
    if (entry.level == 0) {
      const std::uint32_t slot = tree.leaves[entry.node];
      if (slot != QueryTree::nobody) limit = visit(slot);
      continue;
    }
    const std::uint32_t level = entry.level - 1, begin = width * entry.node, left = tree.children_below(level) - begin;
    const native::Bvh::Node& node = tree.nodes[tree.first[level] + entry.node];
    // The newest part of the stack is sorted, the nearest last.
    const int bottom = top;
    float fractions[width];
    const std::uint32_t children = left < width ? (1u << left) - 1 : (1u << width) - 1;
    for (std::uint32_t met = slabs.meets(node, limit, fractions) & children; met != 0; met &= met - 1) {
      const std::uint32_t c = exec::lowest_bit(met);
      int place = top++;
      for (; place > bottom && stack[place - 1].fraction < fractions[c]; --place) stack[place] = stack[place - 1];
      stack[place] = {fractions[c], level, begin + c};
    }
  }
  return limit;
}

}  // namespace fathom::device
