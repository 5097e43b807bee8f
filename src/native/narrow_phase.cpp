#include "native/narrow_phase.hpp"

#include "collision/manifold.hpp"

namespace fathom::native {

namespace {

// A manifold is kept while its bodies have moved against each other by less than this since it was made. The
// points are anchored in both bodies, so their separations stay exact; only which points exist may grow stale, by a
// distance of this order. (Box3D and avian call this contact recycling; it is the largest single gain at rest.)
constexpr float recycle_distance = 0.005f;           // m, and at most a part of the smaller body
constexpr float recycle_part_of_radius = 0.01f;
constexpr float recycle_sine_of_half_angle = 0.0025f;  // 5 mrad

bool moved_little(const Contact& c, const Pose& b_in_a, float smaller_radius) {
  const float limit = min(recycle_distance, recycle_part_of_radius * smaller_radius);
  const Vec3 shift = b_in_a.position - c.position_at_build;
  if (!(length_squared(shift) < limit * limit)) return false;
  // |vector part of conj(q0)·q|² = sin² of half the angle between the two orientations.
  const Vec3 turn = (conjugate(c.rotation_at_build) * b_in_a.rotation).vector();
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
void set_frame(Contact& c, Vec3 normal) {
  const bool had_frame = c.point_count > 0;
  const Vec3 old = mul_add(c.tangent, -dot(c.tangent, normal), normal);
  c.tangent = had_frame && length_squared(old) > 0.25f ? normalize(old) : any_perpendicular(normal);
  c.normal = normal;
}

void set_points(Contact& c, const Manifold& manifold, const Pose& b_in_a) {
  ContactPointState old[max_manifold_points];
  const int old_count = c.point_count;
  for (int i = 0; i < old_count; ++i) old[i] = c.points[i];
  for (int i = 0; i < manifold.count; ++i) {
    const ManifoldPoint& from = manifold.points[i];
    ContactPointState& to = c.points[i];
    const Vec3 half_gap = (0.5f * from.separation) * manifold.normal;
    to.anchor_a = from.position - half_gap;
    to.anchor_b = inverse_transform(b_in_a, from.position + half_gap);
    to.feature = from.feature;
    to.impulse = 0;
    for (int k = 0; k < old_count; ++k)
      if (old[k].feature == from.feature) to.impulse = old[k].impulse;
  }
  c.point_count = static_cast<std::uint8_t>(manifold.count);
}

Change part(Contact& c) {
  if (c.point_count == 0) return Change::nothing;
  c.point_count = 0;
  c.friction_impulse[0] = c.friction_impulse[1] = c.twist_impulse = 0;
  return Change::ended;
}

}  // namespace

Change update_contact(Contact& c, const BodyTable& bodies, const BodyState& state, float dt) {
  if ((state.flags[c.a] | state.flags[c.b]) & box_changed)
    if (!overlaps(state.fat_boxes[c.a], state.fat_boxes[c.b])) return Change::gone;
  if (!overlaps(state.boxes[c.a], state.boxes[c.b])) return part(c);

  const BodyInfo &a = bodies[c.a], &b = bodies[c.b];
  const Pose b_in_a = relative(state.poses[c.a], state.poses[c.b]);
  if (c.point_count > 0 && moved_little(c, b_in_a, min(a.radius, b.radius))) return Change::recycled;

  const float margin = speculative_margin(a, b, state.velocities[c.a], state.velocities[c.b], dt);
  const Manifold manifold = collide(a.geometry, b.geometry, b_in_a, margin, c.axis);
  if (manifold.count == 0) return part(c);
  const bool touched = c.point_count > 0;
  set_frame(c, manifold.normal);
  set_points(c, manifold, b_in_a);
  c.rotation_at_build = b_in_a.rotation;
  c.position_at_build = b_in_a.position;
  return touched ? Change::nothing : Change::began;
}

}  // namespace fathom::native
