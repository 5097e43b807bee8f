#include "world/placement.hpp"

#include <numeric>

#include "geometry/morton_order.hpp"

namespace fathom {

namespace {

constexpr std::size_t min_bodies = 1024;  // fewer fit in one core's cache in any order
constexpr double much_longer = 4;

/// Length of the path from position to position (m).
double way(const std::vector<Vec3>& positions, const std::vector<std::uint32_t>& order) {
  double sum = 0;
  for (std::size_t i = 1; i < order.size(); ++i)
    sum += static_cast<double>(length(positions[order[i]] - positions[order[i - 1]]));
  return sum;
}

}  // namespace

std::vector<std::uint32_t> placement_order(std::span<const BodyDef> defs) {
  std::vector<std::uint32_t> given(defs.size());
  std::iota(given.begin(), given.end(), 0u);
  if (defs.size() < min_bodies) return given;
  std::vector<Vec3> positions;
  positions.reserve(defs.size());
  for (const BodyDef& def : defs) positions.push_back(def.pose.position);
  const std::vector<std::uint32_t> along_curve = morton_order(positions);
  return way(positions, given) > much_longer * way(positions, along_curve) ? along_curve : given;
}

}  // namespace fathom
