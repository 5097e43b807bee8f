#include "validate/exact_surface.hpp"

#include <algorithm>
#include <cmath>

#include "validate/frame.hpp"

namespace fathom::validate {
namespace {

/// Twice the area of the triangle a, b, p as seen from above.
double twice_area(Vec3d a, Vec3d b, Vec3d p) { return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x); }

/// Height of the triangle at the point's x and y, if the triangle covers them.
std::optional<double> height_at(const Triangle& triangle, Vec3d p) {
  const Vec3d a = to_double(triangle.corners[0]), b = to_double(triangle.corners[1]),
              c = to_double(triangle.corners[2]);
  const double whole = twice_area(a, b, c);
  if (!(whole > 0)) return {};  // vertical
  const double of_a = twice_area(b, c, p) / whole, of_b = twice_area(c, a, p) / whole, of_c = 1 - of_a - of_b;
  if (std::min({of_a, of_b, of_c}) < -1e-9) return {};
  return of_a * a.z + of_b * b.z + of_c * c.z;
}

}  // namespace

std::vector<double> depths_in(const Surface& surface, const Pose& pose, std::span<const Solid> solids) {
  std::vector<double> depths(solids.size());
  for (std::uint32_t i = 0; i < surface.triangle_count(); ++i) {
    if (!surface.has(i)) continue;
    const Solid triangle(surface.triangle(i), pose);
    for (std::size_t k = 0; k < solids.size(); ++k) depths[k] = std::max(depths[k], overlap_depth(triangle, solids[k]));
  }
  return depths;
}

Ground::Ground(const Surface& surface)
    : surface_(surface),
      side_(std::clamp(static_cast<int>(std::sqrt(surface.triangle_count() / 2)), 1, 1000)),
      lower_(to_double(surface.bounds().lower)),
      size_(to_double(surface.bounds().upper) - lower_),
      grid_(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_)) {
  for (std::uint32_t t = 0; t < surface.triangle_count(); ++t) {
    if (!surface.has(t)) continue;
    const Triangle triangle = surface.triangle(t);
    const Vec3 least = min(triangle.corners[0], min(triangle.corners[1], triangle.corners[2]));
    const Vec3 most = max(triangle.corners[0], max(triangle.corners[1], triangle.corners[2]));
    for (int j = row(to_double(least.y)); j <= row(to_double(most.y)); ++j)
      for (int i = column(to_double(least.x)); i <= column(to_double(most.x)); ++i) grid_[index(i, j)].push_back(t);
  }
}

int Ground::column(double x) const {
  return std::clamp(static_cast<int>((x - lower_.x) / size_.x * side_), 0, side_ - 1);
}
int Ground::row(double y) const { return std::clamp(static_cast<int>((y - lower_.y) / size_.y * side_), 0, side_ - 1); }

std::optional<double> Ground::height_over(const Pose& pose, Vec3d point) const {
  const Vec3d local = Frame(pose).local(point);
  if (local.x < lower_.x || local.y < lower_.y || local.x > lower_.x + size_.x || local.y > lower_.y + size_.y)
    return {};
  for (const std::uint32_t t : grid_[index(column(local.x), row(local.y))])
    if (const auto height = height_at(surface_.triangle(t), local)) return local.z - *height;
  return {};
}

}  // namespace fathom::validate
