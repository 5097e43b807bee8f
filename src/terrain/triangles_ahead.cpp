#include "terrain/triangles_ahead.hpp"

#include "terrain/triangle_lanes.hpp"

namespace fathom {
namespace {

Eight lowest_along(std::span<const Vec3> points, const EightVec3& directions) {
  Eight lowest = dot(directions, eight(points[0]));
  for (const Vec3 point : points.subspan(1)) lowest = min(dot(directions, eight(point)), lowest);
  return lowest;
}

}  // namespace

void ShapeOnWay::set(const TurnedShape& shape, const ShapeMotion& motion) {
  shape_ = &shape;
  points_.clear(), reaches_.clear();
  const auto add = [&](Vec3 vertex) {
    points_.push_back(vertex);
    points_.push_back(vertex + motion.way + cross(motion.turn, vertex));
  };
  around_ = motion.beside;
  if (shape.is_round()) {
    add(shape.round().core.from), add(end_of(shape.round().core));
    around_ += shape.round().radius;
    return;
  }
  const HullView& hull = shape.turned();
  around_ += hull.radius;
  for (int i = 0; i < hull.vertex_count; ++i) add(hull.vertices[i]);
  for (int f = 0; f < hull.face_count; ++f) {
    float reach = hull.planes[f].offset;
    for (std::size_t i = 1; i < points_.size(); i += 2) reach = max(reach, dot(hull.planes[f].normal, points_[i]));
    reaches_.push_back(reach);
  }
}

unsigned met_on_way(const EightTriangles& triangles, const ShapeOnWay& moving, float skin) {
  const TurnedShape& shape = moving.shape();
  const TriangleLanes<EightLanes> t = make_lanes(triangles);
  const Eight reach = eight(skin + moving.around()) + eight(separation_rounding) * (t.reach + eight(shape.outer()));
  EightInts met =
      (lane_numbers() < eight(triangles.count)) & (lowest_along(moving.points(), t.normals) - t.offsets <= reach);
  for (int k = 0; k < 3 && bits(met) != 0; ++k) {
    const EightVec3 outward = eight(-1.0f) * t.inward[k];
    met = met &
          (lowest_along(moving.points(), outward) - dot(outward, t.corners[k]) <= reach * sqrt(t.squared_lengths[k]));
  }
  if (shape.is_round()) return bits(met);
  const HullView& hull = shape.turned();
  for (int f = 0; f < hull.face_count && bits(met) != 0; ++f) {
    const EightVec3 n = eight(hull.planes[f].normal);
    const Eight lowest = min(dot(n, t.corners[0]), min(dot(n, t.corners[1]), dot(n, t.corners[2])));
    met = met & (lowest - eight(moving.reach_of_face(f)) <= reach);
  }
  return bits(met);
}

}  // namespace fathom
