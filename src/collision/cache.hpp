// Writing the axis cache.
#pragma once

#include "collision/manifold.hpp"

namespace fathom {

/// Edges with numbers too large for the cache are dropped rather than confused with others.
FATHOM_HD AxisCache make_cache(AxisCache::Kind kind, int a, int b, bool separated) {
  if (a > 255 || b > 255) return {};
  return {static_cast<std::uint8_t>(kind), static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b),
          separated ? std::uint8_t{1} : std::uint8_t{0}};
}

}  // namespace fathom
