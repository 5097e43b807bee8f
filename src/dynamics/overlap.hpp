// Bodies that start inside each other, because they were created or moved there. Pure, for host and device.
//
// Pushed out at once, they would reach the surface with a velocity that one relax sweep cannot remove where several
// contacts share a body: stacks hop, and nothing presses until they have come down again. So the initial depth counts
// as touching for the lifetime of the contact, and fades over some tenths of a second. The bodies carry each other from
// the first step and rise slowly.
#pragma once

#include "collision/manifold.hpp"
#include "dynamics/tuning.hpp"

namespace fathom {

/// Half of a shape's thickness (m), from its `Geometry`. A surface is solid behind, so the other shape is the thinner.
FATHOM_HD float half_thickness(ShapeType type, Vec3 half_extents, float radius) {
  if (type == ShapeType::mesh || type == ShapeType::height_field) return 1e6f;
  const bool is_round = type == ShapeType::sphere || type == ShapeType::capsule;
  return is_round ? radius : min(half_extents.x, min(half_extents.y, half_extents.z));
}

/// Depth that counts as touching where a contact begins (m): that of its deepest point, less the `sag` (m) of springs
/// under a body's own weight, so that they press. Where that depth exceeds 10 cm or a tenth of the thinner shape's half
/// thickness, a tenth of it is pushed out in any case, lest a load should push the body through. Bouncing bodies carry
/// nothing, and a hit may turn a body within a step and leave it unexpectedly deep in another. They may start at a
/// larger share of the half thickness, and bounce from there as usual. Of children of compounds (`of_compound`) no
/// greater depth counts: a heap of compounds jammed otherwise (docs/log/2026-11-29-placed-inside-each-other.md).
FATHOM_HD float first_overlap(const Manifold& m, float restitution, float half_thickness_a, float half_thickness_b,
                              float sag, bool of_compound) {
  float nearest = 0;
  for (int i = 0; i < max_manifold_points; ++i)
    if (i < m.count) nearest = min(nearest, m.points[i].separation);
  const float share = restitution > 0 ? bouncing_overlap_share : first_overlap_share;
  const float depth = -nearest, limit = min(max_first_overlap, share * min(half_thickness_a, half_thickness_b));
  if (depth <= limit) return max(depth - sag, 0.0f);
  return of_compound ? 0.0f : min(deep_overlap_share * depth, max_deep_overlap);
}

/// Factor by which an overlap fades within a step of length dt (s).
FATHOM_HD float overlap_kept(float dt) { return overlap_time / (overlap_time + dt); }

/// What remains of `overlap` after a step with the factor `kept`; the nearest points are `nearest` (m) apart. Never
/// more than the shapes overlap: bodies that have parted meet at the surface again.
FATHOM_HD float faded_overlap(float overlap, float nearest, float kept) {
  return min(kept * overlap, max(-nearest, 0.0f));
}

}  // namespace fathom
