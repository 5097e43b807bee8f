// Which bodies collide.
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

}  // namespace fathom
