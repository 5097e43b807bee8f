// When a manifold is rebuilt, and what it keeps from the old one. Pure, for host and device.
#pragma once

#include "dynamics/bounds.hpp"
#include "dynamics/contact_manifold.hpp"
#include "dynamics/tuning.hpp"

namespace fathom {

/// Relative movement (m) of two bodies with these shapes and bounding radii (m) up to which their manifold is kept.
/// Zero where a round shape may roll: its points stay under it, whereas anchors in both bodies would turn away from
/// there, and a load some millimetres off centre would brake or drive it.
FATHOM_HD float recycle_distance(ShapeType shape_a, float radius_a, ShapeType shape_b, float radius_b) {
  const auto rolls = [](ShapeType shape) { return shape == ShapeType::sphere || shape == ShapeType::capsule; };
  return rolls(shape_a) || rolls(shape_b) ? 0.0f : min(max_recycle_distance, recycle_share * min(radius_a, radius_b));
}

/// True while bodies have moved against each other by less than `distance` (m) and 5 mrad since the manifold was made.
/// The manifold is then kept: the points are anchored in both bodies, so their separations stay exact; only the choice
/// of points may become stale, by a distance of this order. (Box3D and avian call this contact recycling; it is the
/// largest single gain at rest.)
FATHOM_HD bool moved_little(const ContactManifold& m, const Pose& b_in_a, float distance) {
  const Vec3 shift = b_in_a.position - m.position_at_build();
  if (!(length_squared(shift) < distance * distance)) return false;
  // |vector part of conj(q0)·q|² = sin² of half the angle between the two orientations.
  const Vec3 turn = (conjugate(m.rotation_at_build) * b_in_a.rotation).vector();
  return length_squared(turn) < recycle_sine_of_half_angle * recycle_sine_of_half_angle;
}

/// Whether the load of a reduced manifold has moved so far to its edge that some point carries nothing, but not to a
/// corner. Then the corners are chosen again: otherwise a body would not tip over the patch's own edge (a cylinder of
/// 32 sides would tip at 22° instead of 26.6°).
FATHOM_HD bool leans(const ContactManifold& m) {
  float sum = 0, most = 0, least = 3e38f;
  for (int i = 0; i < max_manifold_points; ++i) {
    if (i >= m.point_count()) continue;
    sum += m.impulses[i];
    most = max(most, m.impulses[i]);
    least = min(least, m.impulses[i]);
  }
  return least <= idle_share * sum && most < corner_share * sum;
}

/// Whether to choose the corners again: not while the load still settles on the last choice.
FATHOM_HD bool is_to_reduce_anew(AxisCache& cache, const ContactManifold& m) {
  if (!cache.reduced || !leans(m)) return false;
  if (cache.wait == 0) return true;
  --cache.wait;
  return false;
}

/// Load on the patch, from the impulses of the last substep.
FATHOM_HD PatchLoad load_of(const ContactManifold& m) {
  PatchLoad load;
  float sum = 0;
  for (int i = 0; i < max_manifold_points; ++i) {
    if (i >= m.point_count()) continue;
    load.at = mul_add(load.at, m.impulses[i], m.points[i].anchor_a);
    sum += m.impulses[i];
  }
  load.is_known = sum > 1e-30f;  // its inverse is finite
  if (load.is_known) load.at *= 1.0f / sum;
  return load;
}

/// Distance (m) at which two bodies at rest become a contact; the smaller body decides.
FATHOM_HD float margin_at_rest(float radius_a, float radius_b, float dt) {
  return 2 * half_speculative_margin(min(radius_a, radius_b), dt);
}

/// Distance (m) at which two bodies become a contact. Fast ones do so before they meet: the solver can then stop them
/// at the surface.
FATHOM_HD float speculative_margin(float radius_a, float radius_b, const Velocity& va, const Velocity& vb, float dt) {
  const float approach = length(vb.linear - va.linear);
  const float turning = min(length(va.angular) * dt, 1.0f) * radius_a + min(length(vb.angular) * dt, 1.0f) * radius_b;
  return margin_at_rest(radius_a, radius_b, dt) + approach * dt + turning;
}

/// Friction is expressed in a frame that turns with A. A new manifold keeps the old tangent as closely as its normal
/// allows, so the impulses keep their directions in space.
FATHOM_HD Vec3 continued_tangent(const ContactManifold& m, Vec3 normal) {
  const Vec3 old = mul_add(m.tangent, -dot(m.tangent, normal), normal);
  return length_squared(old) > 0.25f ? normalize(old) : any_perpendicular(normal);
}

/// Distributes a load over the points of `m` as an elastic foundation would: pressure is linear in the plane, and
/// points that would have to pull carry none. From four points it takes at most two rounds to reach the two that carry.
FATHOM_HD void share_out(ContactManifold& m, Vec3 at, float sum) {
  const Vec3 x = m.tangent, y = cross(m.normal, x);
  const int count = m.point_count();
  bool carries[max_manifold_points] = {true, true, true, true};
  for (int round = 0; round < 3; ++round) {
    Vec3 middle;
    float used = 0;
    for (int i = 0; i < max_manifold_points; ++i)
      if (i < count && carries[i]) middle += m.points[i].anchor_a, used += 1;
    middle *= 1 / used;
    float xx = 0, xy = 0, yy = 0;
    for (int i = 0; i < max_manifold_points; ++i) {
      if (i >= count || !carries[i]) continue;
      const Vec3 from_middle = m.points[i].anchor_a - middle;
      const float px = dot(from_middle, x), py = dot(from_middle, y);
      xx = fma(px, px, xx), xy = fma(px, py, xy), yy = fma(py, py, yy);
    }
    const float size = xx + yy;
    float lx = dot(at - middle, x), ly = dot(at - middle, y);
    float slope_x = 0, slope_y = 0;
    if (size > 1e-10f * dot(middle, middle)) {  // otherwise they coincide up to rounding, wherever the load is
      // A load farther away tips over the same corner, and rounding would exceed what the points carry.
      const float inside = min(16 * fathom::sqrt(size / max(lx * lx + ly * ly, size)), 1.0f);
      lx *= inside, ly *= inside;
      // In units of the patch, so no product underflows; the small softness across a line saves a special case for two
      // points.
      xx = xx / size + 1e-4f, xy /= size, yy = yy / size + 1e-4f;
      const float scale = 1 / (size * (xx * yy - xy * xy));
      slope_x = (yy * lx - xy * ly) * scale, slope_y = (xx * ly - xy * lx) * scale;
    }
    bool any_pulls = false;
    float total = 0;
    for (int i = 0; i < max_manifold_points; ++i) {
      if (i >= count) continue;
      const Vec3 from_middle = m.points[i].anchor_a - middle;
      const float share = fma(slope_x, dot(from_middle, x), fma(slope_y, dot(from_middle, y), 1 / used));
      m.impulses[i] = carries[i] ? max(share, 0.0f) : 0.0f;
      total += m.impulses[i];
      if (carries[i] && share < 0) carries[i] = false, any_pulls = true;
    }
    // A patch that is a point up to rounding may appear to pull everywhere.
    const bool is_sound = total > 0 && total < 1e30f;
    for (int i = 0; i < max_manifold_points; ++i)
      if (i < count) m.impulses[i] = is_sound ? m.impulses[i] * (sum / total) : sum / static_cast<float>(count);
    if (!any_pulls || !is_sound) return;
  }
}

/// Sets points, anchors and friction frame from a new manifold; points with known features keep their impulses, and
/// impulses of corners that a reduced manifold has lost go to the remaining ones.
FATHOM_HD void set_manifold(ContactManifold& to, const Manifold& from, const Pose& b_in_a, bool reduced = false) {
  const PatchLoad load = reduced ? load_of(to) : PatchLoad{};
  to.tangent = continued_tangent(to, from.normal);
  to.normal = from.normal;
  std::uint32_t old_features[max_manifold_points];
  float old_impulses[max_manifold_points];
  const int old_count = to.point_count();
  // Loops have constant length: GPUs keep these arrays in registers.
  for (int i = 0; i < max_manifold_points; ++i) {
    old_features[i] = i < old_count ? to.points[i].feature : 0;
    old_impulses[i] = i < old_count ? to.impulses[i] : 0;
  }
  const float before = load.is_known ? ((old_impulses[0] + old_impulses[1]) + old_impulses[2]) + old_impulses[3] : 0;
  for (int i = 0; i < max_manifold_points; ++i) {
    if (i >= from.count) continue;
    const ManifoldPoint& source = from.points[i];
    ContactPointState& point = to.points[i];
    const Vec3 half_gap = (0.5f * source.separation) * from.normal;
    point.anchor_a = source.position - half_gap;
    point.anchor_b = inverse_transform(b_in_a, source.position + half_gap);
    point.feature = source.feature;
    to.impulses[i] = 0;
    for (int k = 0; k < max_manifold_points; ++k)
      if (k < old_count && old_features[k] == source.feature) to.impulses[i] = old_impulses[k];
  }
  to.set_build(b_in_a, from.count);
  if (!load.is_known) return;
  float kept = 0;
  for (int i = 0; i < max_manifold_points; ++i)
    if (i < from.count) kept += to.impulses[i];
  if (kept < 0.999f * before) share_out(to, load.at, before);
}

}  // namespace fathom
