// What a moving box meets in a tree of boxes, for queries on host and device.
#pragma once

#include <cstdint>
#include <fathom/box_tree.hpp>

namespace fathom {

/// Maximum number of second children on a search's stack: each node halves its parts.
inline constexpr int deepest_box_tree = 64;

/// The path of a box (half extents, initial centre, translation) against other boxes, by slabs (Kay, Kajiya 1986).
/// The quotients have relative rounding errors. The rounding of coordinates is added to the moving box.
class BoxWay {
 public:
  FATHOM_HD BoxWay(Vec3 centre, Vec3 half, Vec3 translation) {
    const float c[] = {centre.x, centre.y, centre.z}, h[] = {half.x, half.y, half.z},
                t[] = {translation.x, translation.y, translation.z};
    for (int axis = 0; axis < 3; ++axis) {
      centre_[axis] = c[axis];
      half_[axis] = h[axis] + 0x1p-21f * (abs(c[axis]) + abs(t[axis]) + h[axis]);
      // Without movement along an axis, the slab contains all of the path or none of it.
      per_way_[axis] = t[axis] != 0 ? 1 / t[axis] : 0;
    }
  }

  /// The fraction at which the box first meets this one; above 1: never.
  FATHOM_HD float entry(Vec3 lower, Vec3 upper) const {
    constexpr float never = 2, rounding = 1 + 0x1p-20f;
    const float lo[] = {lower.x, lower.y, lower.z}, hi[] = {upper.x, upper.y, upper.z};
    float enter = 0, leave = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const float near = lo[axis] - half_[axis] - centre_[axis], far = hi[axis] + half_[axis] - centre_[axis];
      if (per_way_[axis] == 0) {
        if (near > 0 || far < 0) return never;
        continue;
      }
      const float a = near * per_way_[axis], b = far * per_way_[axis];
      enter = max(enter, min(a, b) * (min(a, b) > 0 ? 1 / rounding : rounding));
      leave = min(leave, max(a, b) * (max(a, b) > 0 ? rounding : 1 / rounding));
    }
    return enter <= leave ? enter : never;
  }

 private:
  float centre_[3], half_[3], per_way_[3];
};

/// Calls limit = act(i, limit) for the parts in leaves that the box meets on its path before the fraction `limit`,
/// roughly nearest first.
template <class Act>
FATHOM_HD void search_box_tree(const BoxTreeNode* nodes, const BoxWay& way, const Act& act) {
  struct Waiting {
    std::uint32_t node;
    float entry;
  };
  Waiting waiting[deepest_box_tree];
  int count = 0;
  float limit = 1;
  const auto entry_of = [&](std::uint32_t node) { return way.entry(nodes[node].lower, nodes[node].upper); };
  Waiting now{0, entry_of(0)};
  for (;;) {
    const BoxTreeNode& n = nodes[now.node];
    if (now.entry <= limit) {
      if (n.count == 0) {
        const Waiting near{now.node + 1, entry_of(now.node + 1)};
        Waiting far{n.next, entry_of(n.next)};
        const bool swapped = far.entry < near.entry;
        now = swapped ? far : near;
        if (swapped) far = near;
        if (far.entry <= limit) waiting[count++] = far;
        continue;
      }
      for (std::uint32_t i = n.next; i < n.next + n.count; ++i) limit = act(i, limit);
    }
    if (count == 0) return;
    now = waiting[--count];
  }
}

}  // namespace fathom
