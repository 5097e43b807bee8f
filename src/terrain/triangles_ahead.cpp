#include "terrain/triangles_ahead.hpp"

#include "terrain/triangle_lanes.hpp"

namespace fathom {
namespace {

/// By how much the path reduces the separation along the axes.
Eight shortened(const EightVec3& axes, const EightVec3& way) { return min(dot(axes, way), eight(0.0f)); }

/// Of the shape's core.
Eight lowest_along(const TurnedShape& shape, const EightVec3& directions) {
  if (!shape.is_round()) return lowest_along<EightLanes>(shape.turned(), directions);
  const Segment& core = shape.round().core;
  return min(dot(directions, eight(core.from)), dot(directions, eight(end_of(core))));
}

}  // namespace

unsigned met_on_way(const EightTriangles& triangles, const TurnedShape& shape, Vec3 way, float around) {
  const TriangleLanes<EightLanes> t = make_lanes(triangles);
  const EightVec3 ways = eight(way);
  const float radius = shape.is_round() ? shape.round().radius : shape.turned().radius;
  const Eight reach = eight(around + radius) + eight(separation_rounding) * (t.reach + eight(shape.outer()));
  const EightVec3& normals = t.normals;
  EightInts met = (lane_numbers() < eight(triangles.count)) &
                  (lowest_along(shape, normals) - t.offsets + shortened(normals, ways) <= reach);
  for (int k = 0; k < 3 && bits(met) != 0; ++k) {
    const EightVec3 outward = eight(-1.0f) * t.inward[k];
    const Eight separation = lowest_along(shape, outward) - dot(outward, t.corners[k]);
    met = met & (separation + shortened(outward, ways) <= reach * sqrt(t.squared_lengths[k]));
  }
  if (shape.is_round()) return bits(met);
  const HullView& hull = shape.turned();
  for (int f = 0; f < hull.face_count && bits(met) != 0; ++f) {
    const Eight shortening = eight(min(-dot(hull.planes[f].normal, way), 0.0f));
    met = met & (separation_from_face(hull, f, t) + shortening <= reach);
  }
  return bits(met);
}

}  // namespace fathom
