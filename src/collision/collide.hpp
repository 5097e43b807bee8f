// Dispatch over shape types, for host and device.
#pragma once

#include "collision/box_box.hpp"
#include "collision/box_hull.hpp"
#include "collision/hull_round.hpp"
#include "collision/polyhedra.hpp"
#include "collision/round_shapes.hpp"

namespace fathom {

FATHOM_HD bool is_round(const Geometry& g) { return g.type == ShapeType::sphere || g.type == ShapeType::capsule; }

/// Box or hull A and a round B.
FATHOM_HD Manifold collide_polyhedron_round(const Geometry& a, const Geometry& b, const Pose& b_in_a, float margin,
                                            AxisCache& cache) {
  if (a.type == ShapeType::box && b.type == ShapeType::sphere) {
    return collide_box_sphere(a.half_extents, b_in_a.position, b.radius, margin);
  }
  const RoundShape round = transform(b_in_a, round_shape(b));
  if (a.type == ShapeType::box) return collide_hull_round(view(BoxHull(a.half_extents)), round, margin, cache);
  return collide_hull_round(a.hull, round, margin, cache);
}

/// Boxes and hulls of which at least one is a hull.
FATHOM_HD Manifold collide_polyhedra(const Geometry& a, const Geometry& b, const Pose& b_in_a, float margin,
                                     AxisCache& cache) {
  if (a.type == ShapeType::box) return collide_hulls(view(BoxHull(a.half_extents)), b.hull, b_in_a, margin, cache);
  if (b.type == ShapeType::box) return collide_hulls(a.hull, view(BoxHull(b.half_extents)), b_in_a, margin, cache);
  return collide_hulls(a.hull, b.hull, b_in_a, margin, cache);
}

/// What `collide` does, as a function that kernels can include.
FATHOM_HD Manifold collide_shapes(const Geometry& a, const Geometry& b, const Pose& b_in_a, float margin,
                                  AxisCache& cache) {
  if (a.type == ShapeType::box && b.type == ShapeType::box) {
    return collide_boxes(a.half_extents, b.half_extents, b_in_a, margin, cache);
  }
  if (is_round(a) && is_round(b)) return collide_round(round_shape(a), transform(b_in_a, round_shape(b)), margin);
  if (is_round(b)) return collide_polyhedron_round(a, b, b_in_a, margin, cache);
  if (is_round(a)) {
    const Pose a_in_b = relative(b_in_a, Pose{});
    return swapped(collide_polyhedron_round(b, a, a_in_b, margin, cache), b_in_a);
  }
  return collide_polyhedra(a, b, b_in_a, margin, cache);
}

}  // namespace fathom
