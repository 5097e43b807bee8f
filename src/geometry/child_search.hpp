// What meets a compound's children first, for host and device.
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

}  // namespace fathom
