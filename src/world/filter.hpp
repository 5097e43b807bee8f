// Which bodies collide.
#pragma once

#include <fathom/body.hpp>

namespace fathom {

inline bool may_collide(const Filter& a, const Filter& b) {
  return (a.category & b.mask) != 0 && (b.category & a.mask) != 0;
}

}  // namespace fathom
