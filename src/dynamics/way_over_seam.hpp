// How far fast bodies may move over seams (collision/seam.hpp). Pure, for host and device.
#pragma once

#include "collision/seam.hpp"
#include "dynamics/free_way.hpp"

namespace fathom {

/// Corrects the `way` of B that A stops, because neighbours of A may hide the feature that stops it: then only B's
/// depth under an exposed face counts. Arguments are those of `free_way`; kept(b_in_a, margin, manifold) returns the
/// part of a manifold that counts, a SeamManifold.
template <bool with_hulls = true, class Kept>
FATHOM_HD void find_way_over_seam(const Mover& a, const Mover& b, const Pose& end_a, const Pose& end_b,
                                  const Apart& first, float half, float dt, const Kept& kept, FreeWay& way) {
  constexpr float same_normal = 0.999f;
  const auto there = [&](const Mover& m, const Pose& end) {
    return way.part < 1 ? advanced(m.pose, velocity_between(m.pose, end, dt), way.part * dt) : end;
  };
  const float skin = skin_of(a, b, half), allowed = allowed_depth(first.gap, half);
  const Pose at_a = there(a, end_a);
  const Vec3 stopping = inverse_rotate(at_a.rotation, way.normal);
  SeamManifold held;
  // At the pose where it is stopped, then, if nothing holds it there, at its end: one call site for both, as in
  // `free_way`.
  for (int look = 0; look < 2; ++look) {
    const bool at_end = look == 1;
    const Pose b_in_a = at_end ? relative(end_a, end_b) : relative(at_a, there(b, end_b));
    const float margin = at_end ? 0 : entry_of(half) + 2 * skin;
    AxisCache axis;
    Manifold m = collide_shapes<with_hulls>(a.geometry, b.geometry, b_in_a, margin, axis);
    if (at_end && m.count == 0) break;
    if (m.count == 0) m = nearest_point(a.geometry, b.geometry, b_in_a, stopping);
    held = kept(b_in_a, margin, m);
    if (at_end) break;
    if (!held.has_neighbours || (held.is_whole && dot(m.normal, stopping) > same_normal)) return;
    if (held.manifold.count > 0) break;
  }
  way = FreeWay{};
  if (held.manifold.count == 0) return;
  const Vec3 normal = rotate(end_a.rotation, held.manifold.normal);
  const NearCores cores = near_cores(a, b, dt, 0);
  const float gap = separation_along(cores, end_a, end_b, normal);
  if (gap < -allowed) way.lift(cores, end_a, end_b, normal, -(gap + allowed));
}

}  // namespace fathom
