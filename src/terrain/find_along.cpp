// Triangles on a moving box's path, for queries.
#include <algorithm>
#include <cmath>
#include <fathom/mesh.hpp>
#include <utility>

#include "geometry/box_tree.hpp"

namespace fathom {
void TriangleMesh::find_along(Vec3 centre, Vec3 half, Vec3 translation, TriangleVisitor& visitor) const {
  const BoxWay way(centre, half, translation);
  search_box_tree(nodes_, way, [&](std::uint32_t t, float limit) {
    const Triangle triangle = this->triangle(t);
    const Vec3 lower = min(triangle.corners[0], min(triangle.corners[1], triangle.corners[2]));
    const Vec3 upper = max(triangle.corners[0], max(triangle.corners[1], triangle.corners[2]));
    return way.entry(lower, upper) <= limit ? visitor.visit(t) : limit;
  });
}

// Goes line by line along the axis on which the box crosses more cells. Each line runs across that axis.
void HeightField::find_along(Vec3 centre, Vec3 half, Vec3 translation, TriangleVisitor& visitor) const {
  struct Axis {
    double centre, half, way, cell;
    std::int64_t cells;

    Axis(float from, float extent, float translation, float width, std::uint32_t samples)
        : centre(static_cast<double>(from)),
          half(static_cast<double>(extent)),
          way(static_cast<double>(translation)),
          cell(static_cast<double>(width)),
          cells(samples - 1) {
      half += 0x1p-21 * (std::abs(centre) + std::abs(way) + half + cell * static_cast<double>(cells));
    }
    /// Range of cells (inclusive) that the box meets between two fractions of its path.
    std::pair<std::int64_t, std::int64_t> range(double from, double to) const {
      const double a = centre + from * way, b = centre + to * way, most = static_cast<double>(cells);
      return {static_cast<std::int64_t>(std::floor(std::clamp((std::min(a, b) - half) / cell, -1.0, most))),
              static_cast<std::int64_t>(std::floor(std::clamp((std::max(a, b) + half) / cell, -1.0, most)))};
    }
    /// Fractions of the path at which the box enters and leaves cell `i`.
    std::pair<double, double> times(std::int64_t i) const {
      if (way == 0) return {0, 1};
      const double a = (static_cast<double>(i) * cell - half - centre) / way,
                   b = (static_cast<double>(i + 1) * cell + half - centre) / way;
      return {std::max(std::min(a, b), 0.0), std::min(std::max(a, b), 1.0)};
    }
  };
  const Axis x(centre.x, half.x, translation.x, cell_x_, columns_), y(centre.y, half.y, translation.y, cell_y_, rows_);
  const bool along_x = std::abs(x.way) / x.cell >= std::abs(y.way) / y.cell;
  const Axis &main = along_x ? x : y, &other = along_x ? y : x;
  const double height = static_cast<double>(centre.z), climb = static_cast<double>(translation.z),
               above = static_cast<double>(half.z) + 0x1p-21 * (std::abs(height) + std::abs(climb));
  double limit = 1;
  auto [line, last] = main.range(0, 1);
  line = std::max<std::int64_t>(line, 0), last = std::min(last, main.cells - 1);
  const std::int64_t step = main.way < 0 ? -1 : 1;
  if (step < 0) std::swap(line, last);
  for (; (last - line) * step >= 0; line += step) {
    const auto [from, to] = main.times(line);
    if (from > limit) return;
    if (to < from) continue;
    const auto [first_across, last_across] = other.range(from, to);
    const double z0 = height + from * climb, z1 = height + to * climb;
    const auto lower = static_cast<float>(std::min(z0, z1) - above),
               upper = static_cast<float>(std::max(z0, z1) + above);
    for (std::int64_t k = std::max<std::int64_t>(first_across, 0); k <= std::min(last_across, other.cells - 1); ++k) {
      const auto i = static_cast<std::uint32_t>(along_x ? line : k), j = static_cast<std::uint32_t>(along_x ? k : line);
      const std::uint32_t number = j * (columns_ - 1) + i;
      if (is_hole(number)) continue;
      for (std::uint32_t t = 2 * number; t < 2 * number + 2; ++t) {
        const Triangle triangle = this->triangle(t);
        const float a = triangle.corners[0].z, b = triangle.corners[1].z, c = triangle.corners[2].z;
        if (min(a, min(b, c)) <= upper && max(a, max(b, c)) >= lower)
          limit = std::min(limit, static_cast<double>(visitor.visit(t)));
      }
    }
  }
}

}  // namespace fathom
