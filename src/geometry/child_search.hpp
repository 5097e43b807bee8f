// Which of a compound's children a query meets, for host and device.
#pragma once

#include "geometry/box_way.hpp"
#include "geometry/query.hpp"

namespace fathom {

/// The first hit among the children in leaves that a moving box meets, up to the fraction `limit` of its path; of
/// equally near children, that with the lowest number. `meet(number, limit, hit)`: whether child `number` is hit up to
/// `limit`. `leaves`: the child of each leaf. True: `first` says where.
template <class Meet>
FATHOM_HD bool meets_child(const BoxTreeNode* nodes, const std::uint32_t* leaves, const BoxWay& way, double limit,
                           const Meet& meet, SurfaceHit& first) {
  bool any = false;
  double end = limit;
  search_box_tree(nodes, way, [&](std::uint32_t leaf, float) {
    const std::uint32_t number = leaves[leaf];
    SurfaceHit hit;
    if (meet(number, static_cast<double>(search_limit(end)), hit) &&
        (!any || hit.fraction < first.fraction || (hit.fraction == first.fraction && number < first.child))) {
      any = true;
      first = hit;
      first.child = number;
      end = static_cast<double>(first.fraction);
    }
    return search_limit(end);
  });
  return any;
}

/// Whether act(number) is true for any child in a leaf whose box meets this one.
template <class Act>
FATHOM_HD bool any_child_in(const BoxTreeNode* nodes, const std::uint32_t* leaves, const Aabb& box, const Act& act) {
  std::uint32_t waiting[deepest_box_tree];
  int count = 0;
  for (std::uint32_t node = 0;;) {
    const BoxTreeNode& n = nodes[node];
    if (overlaps(Aabb{n.lower, n.upper}, box)) {
      if (n.count == 0) {
        waiting[count++] = n.next;
        ++node;
        continue;
      }
      for (std::uint32_t leaf = n.next; leaf < n.next + n.count; ++leaf)
        if (act(leaves[leaf])) return true;
    }
    if (count == 0) return false;
    node = waiting[--count];
  }
}

}  // namespace fathom
