// Bodies that begin inside each other: placed so, or brought there. Pure, for host and device.
//
// Pushed out at once they arrive at the surface with a velocity that one relax sweep does not take away where several
// contacts share a body: stacks hop, and until they have come down again nothing presses. So the depth at which they
// began counts as touching, for a contact's lasting, and fades away in the course of some tenths of a second. They
// carry each other from the first step and rise without haste.
#pragma once

#include "collision/manifold.hpp"
#include "dynamics/tuning.hpp"

namespace fathom {

/// Half of a shape's thickness (m), of its `Geometry`. A surface is solid behind: the other one is the thinner.
FATHOM_HD float half_thickness(ShapeType type, Vec3 half_extents, float radius) {
  if (type == ShapeType::mesh || type == ShapeType::height_field) return 1e6f;
  const bool is_round = type == ShapeType::sphere || type == ShapeType::capsule;
  return is_round ? radius : min(half_extents.x, min(half_extents.y, half_extents.z));
}

/// What counts as touching where a contact begins (m): the depth of its deepest point, less the `sag` (m) that springs
/// have under a body's own weight, so that they press. Nothing where that depth is more than 10 cm or a tenth of the
/// thinner shape's half: who begins as deep might be pushed through by what it carries. What bounces carries nothing,
/// and where hits have turned bodies within a step they are deep inside others that no contact expected: it may be more
/// of the half, from where they bounce as they would have before.
FATHOM_HD float first_overlap(const Manifold& m, float restitution, float half_thickness_a, float half_thickness_b,
                              float sag) {
  float nearest = 0;
  for (int i = 0; i < max_manifold_points; ++i)
    if (i < m.count) nearest = min(nearest, m.points[i].separation);
  const float share = restitution > 0 ? bouncing_overlap_share : first_overlap_share;
  return -nearest <= min(max_first_overlap, share * min(half_thickness_a, half_thickness_b)) ? max(-nearest - sag, 0.0f)
                                                                                             : 0.0f;
}

/// What of an overlap fades within a step of length dt (s) is left with, as a factor.
FATHOM_HD float overlap_kept(float dt) { return overlap_time / (overlap_time + dt); }

/// What is left of `overlap` after a step of which `kept` is left over, the nearest points being `nearest` (m) apart:
/// never more than the shapes overlap, so that what has parted meets at the surface again.
FATHOM_HD float faded_overlap(float overlap, float nearest, float kept) {
  return min(kept * overlap, max(-nearest, 0.0f));
}

}  // namespace fathom
