// Shapes that many queries move or place, in device memory. Each query carries its shape; the corners of hulls, which
// many may share, are apart.
#pragma once

#include <cstdint>
#include <fathom/query.hpp>
#include <span>
#include <unordered_map>
#include <vector>

#include "geometry/placed_shape.hpp"

namespace fathom::device {

struct AskedShape {
  ShapeType type = ShapeType::box;
  float radius = 0;                ///< m, see Geometry
  Vec3 half_extents;               ///< m
  std::uint32_t first_corner = 0;  ///< of a hull, among all corners
  std::int32_t corner_count = 0;
  Pose pose;         ///< where it is, or begins
  Vec3 translation;  ///< m; not read if it is only placed

  FATHOM_HD PlacedShape placed(const Vec3* corners) const {
    Geometry shape{type, radius, half_extents};
    shape.hull.vertices = corners + first_corner, shape.hull.vertex_count = corner_count;
    return {shape, pose};
  }
};

/// The corners of the hulls of many shapes, each hull's once.
class AskedCorners {
 public:
  /// Replaces those of the last call.
  void list(std::span<const ShapeCast> shapes);
  std::span<const Vec3> corners() const { return corners_; }

  /// Writes these shapes, which are among those listed.
  void write(std::span<const ShapeCast> shapes, AskedShape* to) const;

 private:
  std::unordered_map<const Hull*, std::uint32_t> first_;
  std::vector<Vec3> corners_;
};

}  // namespace fathom::device
