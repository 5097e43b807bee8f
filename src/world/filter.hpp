// Which bodies collide.
#pragma once

#include "world/body_table.hpp"

namespace fathom {

inline bool may_collide(const Filter& a, const Filter& b) {
  return (a.category & b.mask) != 0 && (b.category & a.mask) != 0;
}

/// Sensors collide with nobody.
inline bool may_collide(const BodyInfo& a, const BodyInfo& b) {
  return !a.is_sensor && !b.is_sensor && may_collide(a.filter, b.filter);
}

}  // namespace fathom
