// Writing the axis cache.
#pragma once

#include <fathom/math.hpp>

#include "collision/manifold.hpp"

namespace fathom {

/// Edges beyond what the cache can name are forgotten rather than confused with others.
FATHOM_HD AxisCache make_cache(AxisCache::Kind kind, int a, int b, bool separated) {
  if (a > 255 || b > 255) return {};
  return {static_cast<std::uint8_t>(kind), static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b),
          separated ? std::uint8_t{1} : std::uint8_t{0}};
}

// A direction in a plane as one of 63 sectors, 1 to 63, by its place on the square |x| + |y| = 1.

/// 0: the vector has none.
FATHOM_HD std::uint8_t sector_of(float x, float y) {
  const float sum = abs(x) + abs(y);
  if (!(sum > 0)) return 0;
  const float part = abs(y) / sum;
  const float place = y >= 0 ? (x >= 0 ? part : 2 - part) : (x < 0 ? 2 + part : 4 - part);
  return static_cast<std::uint8_t>(1 + min(static_cast<int>(place * (63.0f / 4.0f)), 62));
}
/// Its middle; not of unit length.
FATHOM_HD void sector_middle(int sector, float& x, float& y) {
  const float place = (static_cast<float>(sector) - 0.5f) * (4.0f / 63.0f), part = place - 1;
  x = place < 2 ? -part : place - 3;
  y = place < 1 ? place : place < 3 ? 2 - place : place - 4;
}

/// `AxisCache::load` of a load at `offset` from the middle of a patch with this normal, and the direction that it
/// names.
FATHOM_HD std::uint8_t load_sector(Vec3 offset, Vec3 normal) {
  const Vec3 x = any_perpendicular(normal);
  return sector_of(dot(offset, x), dot(offset, cross(normal, x)));
}
FATHOM_HD Vec3 load_direction(int sector, Vec3 normal) {
  const Vec3 axis = any_perpendicular(normal);
  float x, y;
  sector_middle(sector, x, y);
  return mul_add(x * axis, y, cross(normal, axis));
}

}  // namespace fathom
