// Spheres and capsules against each other and against boxes: closest points, then radii.
#pragma once

#include "collision/closest.hpp"
#include "collision/feature.hpp"
#include "collision/manifold.hpp"
#include "collision/tolerance.hpp"

namespace fathom {

/// A segment with a radius; for a sphere the segment is a point.
struct RoundShape {
  Segment core;
  float radius;
};

FATHOM_HD RoundShape round_shape(const Geometry& g) {
  return {{{0, 0, -g.half_extents.z}, {0, 0, 2.0f * g.half_extents.z}}, g.radius};
}
FATHOM_HD RoundShape transform(const Pose& pose, const RoundShape& shape) {
  return {{transform(pose, shape.core.from), rotate(pose.rotation, shape.core.along)}, shape.radius};
}

/// Adds the point between the surfaces around two core points that are `gap` apart along the manifold's normal.
FATHOM_HD void add_round_point(Manifold& m, Vec3 on_a, float radius_a, float gap, float radius_b,
                               std::uint32_t feature) {
  const float separation = gap - (radius_a + radius_b);
  m.points[m.count++] = {mul_add(on_a, fma(0.5f, separation, radius_a), m.normal), separation, feature};
}

/// The same manifold seen from B: pairs of different types are computed in one order only.
FATHOM_HD Manifold swapped(const Manifold& m, const Pose& b_in_a) {
  Manifold result;
  result.count = m.count;
  result.normal = -rotate(b_in_a.rotation, m.normal);
  for (int i = 0; i < m.count; ++i) {
    result.points[i] = {transform(b_in_a, m.points[i].position), m.points[i].separation,
                        swap_feature(m.points[i].feature)};
  }
  return result;
}

/// Spheres and capsules in any combination.
FATHOM_HD Manifold collide_round(const RoundShape& a, const RoundShape& b, float margin) {
  Manifold m;
  const SegmentPair closest = closest_points(a.core, b.core);
  const Vec3 d = closest.on_2 - closest.on_1;
  const float reach = a.radius + b.radius + margin, gap_squared = length_squared(d);
  if (gap_squared > reach * reach) return m;

  const float gap = fathom::sqrt(gap_squared);
  // Crossing or touching cores define no direction: take one across both.
  const Vec3 across = cross(a.core.along, b.core.along);
  const float length_a = length(a.core.along), length_b = length(b.core.along);
  if (gap > 1e-6f * (a.radius + b.radius)) {
    m.normal = (1.0f / gap) * d;
  } else if (length_squared(across) > 0) {
    m.normal = normalize(across);
  } else {
    m.normal = length_a + length_b > 0 ? any_perpendicular(normalize(length_a > 0 ? a.core.along : b.core.along))
                                       : Vec3{0, 0, 1};
  }

  // Parallel within 0.05 rad: the ends of the shared stretch support better than the single closest pair.
  const float parallel = length_a * length_b;
  if (parallel > 0 && length_squared(across) < 0.0025f * parallel * parallel) {
    const Vec3 axis = (1.0f / length_a) * a.core.along;
    const float b0 = dot(axis, b.core.from - a.core.from), b1 = b0 + dot(axis, b.core.along);
    const float lo = max(0, min(b0, b1)), hi = min(length_a, max(b0, b1));
    if (hi - lo > 0.05f * min(length_a, length_b)) {
      for (int i = 0; i < 2; ++i) {
        const float x = i == 0 ? lo : hi;
        const Vec3 on_a = mul_add(a.core.from, x, axis);
        const Vec3 on_b = mul_add(b.core.from, clamp((x - b0) / (b1 - b0), 0, 1), b.core.along);
        const float gap_here = dot(m.normal, on_b - on_a);
        // Cores that cross leave one end on the wrong side.
        const bool usable = gap_here <= reach && gap_here >= gap - 0.005f * (a.radius + b.radius);
        if (usable) add_round_point(m, on_a, a.radius, gap_here, b.radius, static_cast<std::uint32_t>(i));
      }
      if (m.count == 2) return m;
      m.count = 0;
    }
  }
  add_round_point(m, closest.on_1, a.radius, gap, b.radius, 2);
  return m;
}

/// Box A and a sphere at `centre`.
FATHOM_HD Manifold collide_box_sphere(Vec3 h, Vec3 centre, float radius, float margin) {
  Manifold m;
  const Vec3 surface = max(-h, min(centre, h));
  const Vec3 d = centre - surface;
  const float reach = radius + margin, gap_squared = length_squared(d);
  if (gap_squared > reach * reach) return m;
  const float gap = fathom::sqrt(gap_squared);
  if (gap > 1e-6f * radius) {
    m.normal = (1.0f / gap) * d;
    add_round_point(m, surface, 0, gap, radius, 0);
    return m;
  }
  // Centre inside: out through the nearest face.
  const Vec3 depth = h - abs(centre);
  const int axis = depth.x <= depth.y && depth.x <= depth.z ? 0 : depth.y <= depth.z ? 1 : 2;
  const float side = centre[axis] < 0 ? -1.0f : 1.0f;
  m.normal = {axis == 0 ? side : 0, axis == 1 ? side : 0, axis == 2 ? side : 0};
  add_round_point(m, mul_add(centre, depth[axis], m.normal), 0, -depth[axis], radius, 0);
  return m;
}

}  // namespace fathom
