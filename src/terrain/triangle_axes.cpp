#include "terrain/triangle_axes.hpp"

#include "terrain/triangle_lanes.hpp"

namespace fathom {
namespace {

/// The heights of the triangles' edges along the normals of a hull's faces. The arc of a hull's edge contains a normal
/// of a triangle's edge only if these have different signs for its two faces: they are, but for a positive factor, the
/// products that `find_edges` compares, and serve all edges of a face.
class CrossingPairs {
 public:
  CrossingPairs(const TriangleLanes<EightLanes>& t, const TurnedShape& shape) : shape_(shape) {
    const HullView& hull = shape.turned();
    for (int f = 0; f < hull.face_count; ++f)
      for (int k = 0; k < 3; ++k) heights_[f][k] = dot(t.along[k], eight(hull.planes[f].normal));
    for (int k = 0; k < 3; ++k) lengths_[k] = sqrt(t.squared_lengths[k]);
  }
  bool may_cross(int edge, int k, EightInts near) const {
    constexpr float rounding = 1e-5f;
    const HullView& hull = shape_.turned();
    const Eight left = heights_[hull.edges[2 * edge].face][k], right = heights_[hull.edges[2 * edge + 1].face][k];
    const Eight unsure = eight(rounding + shape_.tilt(edge)) * lengths_[k];
    return bits((min(left, right) <= unsure) & (max(left, right) >= -unsure) & near) != 0;
  }

 private:
  const TurnedShape& shape_;
  Eight lengths_[3];
  Eight heights_[max_faces][3];  // of the hull's faces alone: the rest is never written
};

void store(Eight from, float (&to)[8]) { *reinterpret_cast<Eight*>(to) = from; }
void store(EightInts from, std::int32_t (&to)[8]) { *reinterpret_cast<EightInts*>(to) = from; }

}  // namespace

TriangleAxes face_axes_of(const EightTriangles& triangles, const TurnedShape& shape, float margin,
                          std::span<const Vec3> pushed) {
  TriangleLanes<EightLanes> t = begin_lanes(triangles);
  const EightInts present = lane_numbers() < eight(triangles.count);
  const AxesOfTriangles<EightLanes> found =
      face_axes_of(t, present, shape, margin, pushed.data(), static_cast<int>(pushed.size()));
  TriangleAxes axes;
  axes.near = bits(found.near);
  if (axes.near == 0 || shape.is_round()) return axes;
  store(found.of_normal, axes.of_normal), store(found.of_face, axes.of_face), store(found.face, axes.face);
  return axes;
}

void add_edge_axes(const EightTriangles& triangles, const TurnedShape& shape, float margin, TriangleAxes& axes) {
  if (axes.near == 0 || shape.is_round()) return;
  TriangleLanes<EightLanes> t = begin_lanes(triangles);
  AxesOfTriangles<EightLanes> found{};
  found.near = lane_numbers() < eight(triangles.count);
  found.of_normal = eight(axes.of_normal), found.of_face = eight(axes.of_face);
  t.complete();
  add_edge_axes(t, shape, margin, CrossingPairs(t, shape), found);
  axes.near &= bits(found.near);
  store(found.edge, axes.edge), store(found.edge_of_shape, axes.edge_of_shape);
}

}  // namespace fathom
