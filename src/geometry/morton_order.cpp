#include "geometry/morton_order.hpp"

#include <algorithm>

namespace fathom {

namespace {

/// Inserts two zero bits between neighbouring bits of the low ten.
std::uint32_t spread(std::uint32_t x) {
  x = (x | x << 16) & 0x030000ffu;
  x = (x | x << 8) & 0x0300f00fu;
  x = (x | x << 4) & 0x030c30c3u;
  return (x | x << 2) & 0x09249249u;
}

}  // namespace

std::vector<std::uint32_t> morton_order(const std::vector<Vec3>& positions) {
  if (positions.empty()) return {};
  Vec3 lower = positions.front(), upper = lower;
  for (const Vec3 p : positions) lower = min(lower, p), upper = max(upper, p);
  const Vec3 size = upper - lower;
  const auto cell = [](float x, float least, float extent) {
    return extent > 0 ? static_cast<std::uint32_t>(min(1023.0f, 1024.0f * ((x - least) / extent))) : 0u;
  };
  std::vector<std::uint64_t> keys(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const Vec3 p = positions[i];
    const std::uint32_t code = spread(cell(p.x, lower.x, size.x)) | spread(cell(p.y, lower.y, size.y)) << 1 |
                               spread(cell(p.z, lower.z, size.z)) << 2;
    keys[i] = std::uint64_t{code} << 32 | i;
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> order(positions.size());
  for (std::size_t i = 0; i < keys.size(); ++i) order[i] = static_cast<std::uint32_t>(keys[i]);
  return order;
}

}  // namespace fathom
