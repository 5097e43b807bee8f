#include "terrain/triangle_axes.hpp"

#include "terrain/triangle_lanes.hpp"

namespace fathom {
namespace {

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
  add_edge_axes(t, shape, margin, found);
  axes.near &= bits(found.near);
  store(found.edge, axes.edge), store(found.edge_of_shape, axes.edge_of_shape);
}

}  // namespace fathom
