#include "validate/cut_stone.hpp"

#include <algorithm>
#include <cmath>

namespace fathom::validate {

std::vector<Vec3d> corners_of(const std::vector<Plane>& planes) {
  constexpr double rounding = 1e-9;  // m, for stones of about a metre
  std::vector<Vec3d> corners;
  for (std::size_t i = 0; i < planes.size(); ++i)
    for (std::size_t j = i + 1; j < planes.size(); ++j)
      for (std::size_t k = j + 1; k < planes.size(); ++k) {
        const Plane &a = planes[i], &b = planes[j], &c = planes[k];
        const double determinant = dot(a.normal, cross(b.normal, c.normal));
        if (std::abs(determinant) < 1e-9) continue;  // parallel to a line: no corner
        const Vec3d p = 1 / determinant *
                        (a.offset * cross(b.normal, c.normal) + b.offset * cross(c.normal, a.normal) +
                         c.offset * cross(a.normal, b.normal));
        const auto keeps = [&](const Plane& plane) { return dot(plane.normal, p) <= plane.offset + rounding; };
        const auto is_here = [&](const Vec3d& q) { return dot(p - q, p - q) < rounding * rounding; };
        if (std::ranges::all_of(planes, keeps) && std::ranges::none_of(corners, is_here)) corners.push_back(p);
      }
  return corners;
}

BodyDef stone_of(const std::vector<Vec3d>& corners, Vec3d inside, const Material& material) {
  std::vector<Vec3> points;
  for (const Vec3d& p : corners) points.push_back(to_float(p - inside));
  BodyDef def;
  def.shape = hull(points);
  def.pose.position = to_float(inside + to_double(def.shape.hull->offset()));
  def.material = material;
  return def;
}

}  // namespace fathom::validate
