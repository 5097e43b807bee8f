// What lies in or below a triangle surface, slow and exact. It shares no code with the engine's collision detection.
#pragma once

#include <fathom/mesh.hpp>
#include <optional>
#include <span>
#include <vector>

#include "validate/exact_overlap.hpp"

namespace fathom::validate {

/// Depth of each solid in the placed surface (m): the largest, over all triangles, of the least separating distances.
std::vector<double> depths_in(const Surface& surface, const Pose& pose, std::span<const Solid> solids);

/// Ground without overhangs: heights above its triangles.
class Ground {
 public:
  explicit Ground(const Surface& surface);

  /// Height (m) of the point above the triangle at its x and y, along z of the placed surface; negative below it. None
  /// beside the surface and in holes.
  std::optional<double> height_over(const Pose& pose, Vec3d point) const;

 private:
  std::size_t index(int i, int j) const { return static_cast<std::size_t>(j * side_ + i); }
  int column(double x) const;
  int row(double y) const;

  const Surface& surface_;
  int side_;  // cells of a grid along x and y
  Vec3d lower_, size_;
  std::vector<std::vector<std::uint32_t>> grid_;  // triangles by the cells that they cover, seen from above
};

}  // namespace fathom::validate
