// The library's shapes shared by tests of the world.
#pragma once

#include <cmath>
#include <fathom/shape.hpp>
#include <numbers>
#include <vector>

namespace fathom::test {

inline Shape box_hull(Vec3 half) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i)
    corners.push_back({i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y, i & 4 ? half.z : -half.z});
  return hull(corners);
}

/// A prism about z with `sides` sides.
inline Shape cylinder_hull(float radius, float half_length, int sides) {
  std::vector<Vec3> corners;
  for (int i = 0; i < sides; ++i) {
    const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(sides);
    for (const float z : {-half_length, half_length})
      corners.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
  }
  return hull(corners);
}

}  // namespace fathom::test
