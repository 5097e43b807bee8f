// The axes that separate triangles from a convex shape (separating axis theorem), for eight triangles at once: most
// triangles that a shape's bounds meet are farther away than the margin and need no individual test.
#pragma once

#include <span>

#include "terrain/eight_triangles.hpp"
#include "terrain/turned_shape.hpp"

namespace fathom {

/// Results for each of eight triangles.
struct TriangleAxes {
  unsigned near = 0;  ///< a bit for each triangle that no axis tried separates by more than the margin
  // For a box or a hull:
  alignas(32) float of_normal[8];  ///< m, separation along the triangle's normal
  alignas(32) float of_face[8];    ///< m, along the normal of the shape's best face
  alignas(32) std::int32_t face[8];
  /// Edges of the triangle and of the shape with the largest separation, if that exceeds the separation of all faces by
  /// more than the tolerance; else −1.
  alignas(32) std::int32_t edge[8], edge_of_shape[8];

  /// Sets those of one triangle.
  void put(int lane, const TriangleAxes& from, int lane_from) {
    near |= 1u << lane;
    of_normal[lane] = from.of_normal[lane_from], of_face[lane] = from.of_face[lane_from];
    face[lane] = from.face[lane_from];
  }
  /// Those of one triangle.
  AxesOfTriangles<OneLane> at(int lane) const {
    return {(near >> lane & 1) != 0, of_normal[lane], of_face[lane], face[lane], edge[lane], edge_of_shape[lane]};
  }
};

/// Without the axes across two edges. `pushed`: unit normals along which the surface already pushes the shape
/// (triangle_axes-inl.hpp). `margin` in m.
TriangleAxes face_axes_of(const EightTriangles& triangles, const TurnedShape& shape, float margin,
                          std::span<const Vec3> pushed);
/// Adds the axes across two edges: none for a round shape.
void add_edge_axes(const EightTriangles& triangles, const TurnedShape& shape, float margin, TriangleAxes& axes);

/// Triangles near a shape along the axes of their faces, gathered from many: a search of edges for eight costs as much
/// as for one, and most triangles are apart already.
class GatheredTriangles {
 public:
  bool is_full() const { return triangles_.count == 8; }
  void clear() { triangles_.count = 0, axes_.near = 0; }
  void add(const EightTriangles& triangles, const TriangleAxes& axes, int lane, std::uint32_t number) {
    numbers_[triangles_.count] = number;
    axes_.put(triangles_.count, axes, lane);
    triangles_.add(triangles.at(lane));
  }
  /// Calls act(triangle, axes, number) for those that are near along all axes, in the order in which they were added.
  template <class Act>
  void for_each_near(const TurnedShape& shape, float margin, const Act& act) {
    add_edge_axes(triangles_, shape, margin, axes_);
    for (unsigned near = axes_.near; near != 0; near &= near - 1) {
      const int lane = lowest_bit(near);
      act(triangles_.at(lane), axes_.at(lane), numbers_[lane]);
    }
  }

 private:
  EightTriangles triangles_;
  TriangleAxes axes_;
  std::uint32_t numbers_[8];
};

}  // namespace fathom
