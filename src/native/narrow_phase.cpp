#include "native/narrow_phase.hpp"

#include "collision/manifold.hpp"

namespace fathom::native {

namespace {

// A manifold is kept while its bodies have moved against each other by less than `Contact::recycle_distance` and 5 mrad
// since it was made. The points are anchored in both bodies, so their separations stay exact; only which points exist
// may grow stale, by a distance of this order. (Box3D and avian call this contact recycling; it is the largest single
// gain at rest.)
constexpr float recycle_sine_of_half_angle = 0.0025f;

bool moved_little(const Contact& c, const ContactManifold& m, const Pose& b_in_a) {
  const Vec3 shift = b_in_a.position - m.position_at_build();
  if (!(length_squared(shift) < c.recycle_distance * c.recycle_distance)) return false;
  // |vector part of conj(q0)·q|² = sin² of half the angle between the two orientations.
  const Vec3 turn = (conjugate(m.rotation_at_build) * b_in_a.rotation).vector();
  return length_squared(turn) < recycle_sine_of_half_angle * recycle_sine_of_half_angle;
}

// Bodies that close in fast become a contact before they meet, so that the solver can stop them at the surface.
float speculative_margin(const BodyInfo& a, const BodyInfo& b, const Velocity& va, const Velocity& vb, float dt) {
  const float approach = length(vb.linear - va.linear);
  const float turning = min(length(va.angular) * dt, 1.0f) * a.radius + min(length(vb.angular) * dt, 1.0f) * b.radius;
  return 2 * half_speculative_margin + approach * dt + turning;
}

// Friction lives in a frame that turns with A. A new manifold keeps the old tangent as nearly as its normal allows, so
// that the impulses stay where they were in space.
Vec3 continued_tangent(const ContactManifold& m, Vec3 normal) {
  const Vec3 old = mul_add(m.tangent, -dot(m.tangent, normal), normal);
  return length_squared(old) > 0.25f ? normalize(old) : any_perpendicular(normal);
}

}  // namespace

void set_manifold(ContactManifold& to, const Manifold& from, const Pose& b_in_a) {
  to.tangent = continued_tangent(to, from.normal);
  to.normal = from.normal;
  std::uint32_t old_features[max_manifold_points];
  float old_impulses[max_manifold_points];
  const int old_count = to.point_count();
  for (int i = 0; i < old_count; ++i) old_features[i] = to.points[i].feature, old_impulses[i] = to.impulses[i];
  for (int i = 0; i < from.count; ++i) {
    const ManifoldPoint& source = from.points[i];
    ContactPointState& point = to.points[i];
    const Vec3 half_gap = (0.5f * source.separation) * from.normal;
    point.anchor_a = source.position - half_gap;
    point.anchor_b = inverse_transform(b_in_a, source.position + half_gap);
    point.feature = source.feature;
    to.impulses[i] = 0;
    for (int k = 0; k < old_count; ++k)
      if (old_features[k] == source.feature) to.impulses[i] = old_impulses[k];
  }
  to.set_build(b_in_a, from.count);
}

Change update_contact(std::uint32_t index, Contact& c, ContactManifold* manifold, const BodyTable& bodies,
                      const BodyState& state, float dt, std::vector<NewManifold>& begun) {
  if ((state.flags[c.a] | state.flags[c.b]) & box_changed)
    if (!overlaps(state.fat_boxes[c.a], state.fat_boxes[c.b])) return Change::gone;
  const Change parted = manifold ? Change::ended : Change::nothing;
  if (!overlaps(state.boxes[c.a], state.boxes[c.b])) return parted;

  const Pose b_in_a = relative(state.poses[c.a], state.poses[c.b]);
  if (manifold && moved_little(c, *manifold, b_in_a)) return Change::recycled;

  const BodyInfo &a = bodies[c.a], &b = bodies[c.b];
  const float margin = speculative_margin(a, b, state.velocities[c.a], state.velocities[c.b], dt);
  const Manifold fresh = collide(a.geometry, b.geometry, b_in_a, margin, c.axis);
  if (fresh.count == 0) return parted;
  if (!manifold) {
    begun.push_back({index, b_in_a, fresh});
    return Change::began;
  }
  set_manifold(*manifold, fresh, b_in_a);
  return Change::nothing;
}

}  // namespace fathom::native
