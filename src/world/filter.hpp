// Which bodies collide, and which a query sees.
#pragma once

#include <fathom/body.hpp>

namespace fathom {

FATHOM_HD bool may_collide(const Filter& a, const Filter& b) {
  if (a.group == b.group && a.group != 0) return a.group > 0;
  return (a.category & b.mask) != 0 && (b.category & a.mask) != 0;
}

/// Whether this filter may reject a body whose own filter accepts all.
inline bool may_keep_out(const Filter& filter) {
  return filter.category == 0 || filter.mask != ~std::uint64_t{0} || filter.group < 0;
}

/// What a QueryFilter says of categories, groups and sensors.
struct QuerySight {
  std::uint64_t mask = ~std::uint64_t{0};
  std::uint64_t category = 0;
  std::int32_t group = 0;
  bool sensors = false;

  FATHOM_HD bool sees(const Filter& body, bool is_sensor) const {
    if (is_sensor && !sensors) return false;
    if (group != 0 && group == body.group) return group > 0;
    return (body.category & mask) != 0 && (category == 0 || (category & body.mask) != 0);
  }
};

}  // namespace fathom
