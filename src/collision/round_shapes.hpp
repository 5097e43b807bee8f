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

/// Cores that are parallel within 0.05 rad, side by side: the ends of the stretch that they share.
struct SharedStretch {
  Vec3 on_a[2], on_b[2];

  /// The stretch within [from, to] (m) along `axis`, the unit direction of A's core. False: it is too short.
  FATHOM_HD bool find(const Segment& a, const Segment& b, Vec3 axis, float length_a, float from, float to) {
    const float b0 = dot(axis, b.from - a.from), b1 = b0 + dot(axis, b.along);
    const float lo = max(max(0, from), min(b0, b1)), hi = min(min(length_a, to), max(b0, b1));
    for (int i = 0; i < 2; ++i) {
      const float x = i == 0 ? lo : hi;
      on_a[i] = mul_add(a.from, x, axis);
      on_b[i] = mul_add(b.from, clamp((x - b0) / (b1 - b0), 0, 1), b.along);
    }
    return hi - lo > 0.05f * min(length_a, abs(b1 - b0));
  }
};

/// Spheres and capsules in any combination.
FATHOM_HD Manifold collide_round(const RoundShape& a, const RoundShape& b, float margin) {
  Manifold m;
  const SegmentPair closest = closest_points(a.core, b.core);
  Vec3 d = closest.on_2 - closest.on_1, on_a = closest.on_1;
  float nearest = closest.s;
  const Vec3 across = cross(a.core.along, b.core.along);
  const float length_a = length(a.core.along), length_b = length(b.core.along), parallel = length_a * length_b;
  const float radii = a.radius + b.radius;
  SharedStretch shared;
  const Vec3 axis = length_a > 0 ? (1.0f / length_a) * a.core.along : Vec3{};
  bool is_shared = parallel > 0 && length_squared(across) < 0.0025f * parallel * parallel &&
                   shared.find(a.core, b.core, axis, length_a, 0, length_a);
  // For segments this parallel, the closest pair may be any; an end may be nearer.
  for (int i = 0; is_shared && i < 2; ++i) {
    const Vec3 there = shared.on_b[i] - shared.on_a[i];
    if (!(length_squared(there) < length_squared(d))) continue;
    d = there, on_a = shared.on_a[i];
    nearest = dot(axis, on_a - a.core.from) / length_a;
  }
  const float reach = radii + margin, gap_squared = length_squared(d);
  if (gap_squared > reach * reach) return m;

  const float gap = fathom::sqrt(gap_squared);
  // Crossing or touching cores define no direction: take one across both.
  if (gap > 1e-6f * radii) {
    m.normal = (1.0f / gap) * d;
  } else if (length_squared(across) > 0) {
    m.normal = normalize(across);
  } else {
    m.normal = length_a + length_b > 0 ? any_perpendicular(normalize(length_a > 0 ? a.core.along : b.core.along))
                                       : Vec3{0, 0, 1};
  }

  // The ends of the shared stretch support better than the single closest pair. Beyond a tenth of the radii beside each
  // other, cores that cross at an angle are farther apart than they seem along the normal, as long ones soon are.
  std::uint32_t feature = 2;
  if (is_shared) {
    const float sideways = abs(dot(m.normal, across)), beside = 0.1f * radii * parallel;
    if (sideways * length_a > beside) {
      const float within = beside / sideways;
      is_shared = shared.find(a.core, b.core, axis, length_a, nearest * length_a - within, nearest * length_a + within);
    }
    for (int i = 0; is_shared && i < 2; ++i) {
      const float gap_here = dot(m.normal, shared.on_b[i] - shared.on_a[i]);
      // Cores that cross leave one end on the wrong side.
      const bool usable = gap_here <= reach && gap_here >= gap - 0.005f * radii;
      if (!usable) continue;
      feature = static_cast<std::uint32_t>(i);
      add_round_point(m, shared.on_a[i], a.radius, gap_here, b.radius, feature);
    }
    if (m.count == 2) return m;
    m.count = 0;
  }
  add_round_point(m, on_a, a.radius, gap, b.radius, feature);
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
