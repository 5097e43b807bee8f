// Triangles on a moving box's path, for queries on host and device.
#pragma once

#include <cmath>
#include <cstdint>
#include <fathom/mesh.hpp>

#include "geometry/box_way.hpp"

namespace fathom {

/// Visits the triangles of a mesh with this tree. `triangle(number)` is a Triangle; limit = act(number, triangle) is
/// the fraction up to which others count.
template <class TriangleOf, class Act>
FATHOM_HD void triangles_along(const BoxTreeNode* nodes, const BoxWay& way, const TriangleOf& triangle_of,
                               const Act& act) {
  search_box_tree(nodes, way, [&](std::uint32_t number, float limit) {
    const Triangle triangle = triangle_of(number);
    const Vec3 lower = min(triangle.corners[0], min(triangle.corners[1], triangle.corners[2]));
    const Vec3 upper = max(triangle.corners[0], max(triangle.corners[1], triangle.corners[2]));
    return way.entry(lower, upper) <= limit ? act(number, triangle) : limit;
  });
}

/// The cells of a height field along one of its axes, and the moving box's part of it. In double precision: a path may
/// be far longer than a cell.
class CellRow {
 public:
  FATHOM_HD CellRow(float from, float extent, float translation, float width, std::uint32_t samples)
      : centre_(static_cast<double>(from)),
        half_(static_cast<double>(extent)),
        way_(static_cast<double>(translation)),
        cell_(static_cast<double>(width)),
        cells_(samples - 1) {
    half_ += 0x1p-21 * (std::abs(centre_) + std::abs(way_) + half_ + cell_ * static_cast<double>(cells_));
  }

  /// First and last cell, or a fraction of the path at which the box enters and leaves.
  template <class T>
  struct Span {
    T first, last;
  };
  /// Cells that the box meets between two fractions of its path.
  FATHOM_HD Span<std::int64_t> cells(double from, double to) const {
    const double a = centre_ + from * way_, b = centre_ + to * way_;
    const std::int64_t first = cell_at((a < b ? a : b) - half_), last = cell_at((a < b ? b : a) + half_);
    return {first > 0 ? first : 0, last < cells_ ? last : cells_ - 1};
  }
  /// Fractions of the path between which the box meets cell `i`.
  FATHOM_HD Span<double> times(std::int64_t i) const {
    if (way_ == 0) return {0, 1};
    const double a = (static_cast<double>(i) * cell_ - half_ - centre_) / way_,
                 b = (static_cast<double>(i + 1) * cell_ + half_ - centre_) / way_;
    const double first = a < b ? a : b, last = a < b ? b : a;
    return {first > 0 ? first : 0.0, last < 1 ? last : 1.0};
  }
  FATHOM_HD double cells_crossed() const { return std::abs(way_) / cell_; }
  FATHOM_HD bool is_backwards() const { return way_ < 0; }

 private:
  /// −1 and the number of cells stand for all positions before and beyond them.
  FATHOM_HD std::int64_t cell_at(double x) const {
    const double cell = x / cell_, most = static_cast<double>(cells_);
    return static_cast<std::int64_t>(std::floor(cell < -1 ? -1.0 : cell > most ? most : cell));
  }

  double centre_, half_, way_, cell_;
  std::int64_t cells_;
};

/// Visits the triangles of a height field (a HeightField or the like) whose cells and heights the box meets. Goes line
/// by line along the axis on which the box crosses more cells. Each line runs across that axis.
template <class Field, class Act>
FATHOM_HD void triangles_along(const Field& field, Vec3 centre, Vec3 half, Vec3 translation, const Act& act) {
  const CellRow x(centre.x, half.x, translation.x, field.cell_x(), field.columns());
  const CellRow y(centre.y, half.y, translation.y, field.cell_y(), field.rows());
  const bool along_x = x.cells_crossed() >= y.cells_crossed();
  const CellRow &main = along_x ? x : y, &other = along_x ? y : x;
  const double height = static_cast<double>(centre.z), climb = static_cast<double>(translation.z),
               above = static_cast<double>(half.z) + 0x1p-21 * (std::abs(height) + std::abs(climb));
  double limit = 1;
  const auto lines = main.cells(0, 1);
  const std::int64_t count = lines.last - lines.first + 1;
  for (std::int64_t n = 0; n < count; ++n) {
    const std::int64_t line = main.is_backwards() ? lines.last - n : lines.first + n;
    const auto times = main.times(line);
    if (times.first > limit) return;
    if (times.last < times.first) continue;
    const auto across = other.cells(times.first, times.last);
    const double z0 = height + times.first * climb, z1 = height + times.last * climb;
    const auto lower = static_cast<float>((z0 < z1 ? z0 : z1) - above),
               upper = static_cast<float>((z0 < z1 ? z1 : z0) + above);
    for (std::int64_t k = across.first; k <= across.last; ++k) {
      const auto i = static_cast<std::uint32_t>(along_x ? line : k), j = static_cast<std::uint32_t>(along_x ? k : line);
      const std::uint32_t cell = j * (field.columns() - 1) + i;
      if (field.is_hole(cell)) continue;
      for (std::uint32_t number = 2 * cell; number < 2 * cell + 2; ++number) {
        const Triangle triangle = field.triangle(number);
        const float a = triangle.corners[0].z, b = triangle.corners[1].z, c = triangle.corners[2].z;
        if (min(a, min(b, c)) > upper || max(a, max(b, c)) < lower) continue;
        const auto next = static_cast<double>(act(number, triangle));
        if (next < limit) limit = next;
      }
    }
  }
}

}  // namespace fathom
