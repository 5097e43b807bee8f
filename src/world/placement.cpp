#include "world/placement.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace fathom {

namespace {

constexpr std::size_t least_bodies = 1024;  // fewer stay in one core's cache in any order
constexpr double much_longer = 4;

/// The way from body to body (m).
double way(std::span<const BodyDef> defs, std::span<const std::uint32_t> order) {
  double sum = 0;
  for (std::size_t i = 1; i < order.size(); ++i)
    sum += static_cast<double>(length(defs[order[i]].pose.position - defs[order[i - 1]].pose.position));
  return sum;
}

constexpr int bits = 21;  // an axis

/// Two zero bits between neighbouring ones.
std::uint64_t spread_bits(std::uint64_t x) {
  x = (x | x << 32) & 0x1f00000000ffffu;
  x = (x | x << 16) & 0x1f0000ff0000ffu;
  x = (x | x << 8) & 0x100f00f00f00f00fu;
  x = (x | x << 4) & 0x10c30c30c30c30c3u;
  return (x | x << 2) & 0x1249249249249249u;
}

/// Morton codes of positions, in cubes of one size over all of them; of what is not finite, any.
std::vector<std::uint64_t> morton_codes(std::span<const BodyDef> defs) {
  Vec3 lower = defs[0].pose.position, upper = lower;
  for (const BodyDef& def : defs) {
    lower = min(lower, def.pose.position);
    upper = max(upper, def.pose.position);
  }
  const float extent = max_component(upper - lower);
  constexpr float cells = static_cast<float>((1 << bits) - 1);
  const auto cell = [&](float x, float least) {
    const float share = (x - least) / extent;
    return spread_bits(static_cast<std::uint64_t>((share >= 0 && share <= 1 ? share : 0) * cells));
  };
  std::vector<std::uint64_t> codes;
  codes.reserve(defs.size());
  for (const BodyDef& def : defs) {
    const Vec3 p = def.pose.position;
    codes.push_back(cell(p.x, lower.x) | cell(p.y, lower.y) << 1 | cell(p.z, lower.z) << 2);
  }
  return codes;
}

}  // namespace

std::vector<std::uint32_t> placement_order(std::span<const BodyDef> defs) {
  std::vector<std::uint32_t> given(defs.size());
  std::iota(given.begin(), given.end(), 0u);
  if (defs.size() < least_bodies) return given;
  const std::vector<std::uint64_t> codes = morton_codes(defs);
  std::vector<std::uint32_t> along_curve = given;
  std::stable_sort(along_curve.begin(), along_curve.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return codes[a] < codes[b]; });
  return way(defs, given) > much_longer * way(defs, along_curve) ? along_curve : given;
}

}  // namespace fathom
