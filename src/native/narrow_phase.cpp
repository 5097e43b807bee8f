#include "native/narrow_phase.hpp"

#include "collision/manifold.hpp"
#include "dynamics/manifold_update.hpp"

namespace fathom::native {

float recycle_distance(const BodyInfo& a, const BodyInfo& b) {
  return fathom::recycle_distance(a.shape.type, a.radius, b.shape.type, b.radius);
}

Inspection inspect_contact(Contact& c, const ContactManifold* manifold, const BodyTable& bodies, const BodyState& state,
                           float dt) {
  if ((state.flags[c.a] | state.flags[c.b]) & box_changed)
    if (!overlaps(state.fat_boxes[c.a], state.fat_boxes[c.b])) return {Change::gone};
  if (!overlaps(state.boxes[c.a], state.boxes[c.b])) return {manifold ? Change::ended : Change::nothing};

  const Pose b_in_a = relative(state.poses[c.a], state.poses[c.b]);
  if (manifold && moved_little(*manifold, b_in_a, max(c.recycle_distance, 0.0f))) return {Change::recycled};

  const BodyInfo &a = bodies[c.a], &b = bodies[c.b];
  constexpr float faded = 1e-7f;  // m
  if (c.recycle_distance <= 0 && c.overlap() < faded) c.recycle_distance = recycle_distance(a, b);
  const float margin = speculative_margin(a.radius, b.radius, state.velocities[c.a], state.velocities[c.b], dt);
  return {Change::nothing, true, margin, b_in_a};
}

Change take_manifold(std::uint32_t index, const Manifold& fresh, const Pose& b_in_a, ContactManifold* manifold,
                     std::vector<NewManifold>& begun) {
  if (fresh.count == 0) return manifold ? Change::ended : Change::nothing;
  if (!manifold) {
    begun.push_back({index, b_in_a, fresh});
    return Change::began;
  }
  set_manifold(*manifold, fresh, b_in_a);
  return Change::nothing;
}

Change update_contact(std::uint32_t index, Contact& c, ContactManifold* manifold, const BodyTable& bodies,
                      const BodyState& state, float dt, std::vector<NewManifold>& begun) {
  const Inspection seen = inspect_contact(c, manifold, bodies, state, dt);
  if (!seen.collide) return seen.change;
  const Manifold fresh = collide(bodies[c.a].geometry, bodies[c.b].geometry, seen.b_in_a, seen.margin, c.axis);
  return take_manifold(index, fresh, seen.b_in_a, manifold, begun);
}

}  // namespace fathom::native
