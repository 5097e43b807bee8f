// Dispatch over shape types, for host and device.
#pragma once

#include "collision/box_box.hpp"
#include "collision/box_hull.hpp"
#include "collision/hull_round.hpp"
#include "collision/polyhedra.hpp"
#include "collision/round_shapes.hpp"
#include "collision/rounded.hpp"

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

/// Boxes and hulls, at least one of them a hull.
FATHOM_HD Manifold collide_polyhedra(const Geometry& a, const Geometry& b, const Pose& b_in_a, float margin,
                                     AxisCache& cache, const PatchLoad& load) {
  const bool is_box_a = a.type == ShapeType::box, is_box_b = b.type == ShapeType::box;
  if (!is_box_a && !is_box_b) return collide_rounded(a.hull, b.hull, b_in_a, margin, cache, load);
  const BoxHull box(is_box_a ? a.half_extents : b.half_extents);
  return collide_rounded(is_box_a ? view(box) : a.hull, is_box_b ? view(box) : b.hull, b_in_a, margin, cache, load);
}

/// Any shapes except two boxes; a kernel that never sees a hull does not need `with_hulls`. Each function has as few
/// call sites as possible: SYCL compilers inline every call in kernels.
template <bool with_hulls = true>
FATHOM_HD Manifold collide_others(const Geometry& a, const Geometry& b, const Pose& b_in_a, float margin,
                                  AxisCache& cache, const PatchLoad& load = {}) {
  if (a.type == ShapeType::box && b.type == ShapeType::sphere)  // cheap, so the general path would slow it down
    return collide_box_sphere(a.half_extents, b_in_a.position, b.radius, margin);
  const bool is_round_a = is_round(a), is_round_b = is_round(b);
  if (is_round_a && is_round_b) return collide_round(round_shape(a), transform(b_in_a, round_shape(b)), margin);
  if constexpr (with_hulls)
    if (!is_round_a && !is_round_b) return collide_polyhedra(a, b, b_in_a, margin, cache, load);
  const Pose round_in_other = is_round_b ? b_in_a : relative(b_in_a, Pose{});
  Manifold manifold = collide_polyhedron_round(is_round_b ? a : b, is_round_b ? b : a, round_in_other, margin, cache);
  if (is_round_a) manifold = swapped(manifold, b_in_a);
  return manifold;
}

/// `collide` as a function that kernels can include.
template <bool with_hulls = true>
FATHOM_HD Manifold collide_shapes(const Geometry& a, const Geometry& b, const Pose& b_in_a, float margin,
                                  AxisCache& cache, const PatchLoad& load = {}) {
  if (a.type == ShapeType::box && b.type == ShapeType::box)
    return collide_boxes(a.half_extents, b.half_extents, b_in_a, margin, cache, load);
  return collide_others<with_hulls>(a, b, b_in_a, margin, cache, load);
}

}  // namespace fathom
