#include "native/narrow_phase.hpp"

#include "collision/manifold.hpp"
#include "dynamics/manifold_update.hpp"

namespace fathom::native {

Change update_contact(std::uint32_t index, Contact& c, ContactManifold* manifold, const BodyTable& bodies,
                      const BodyState& state, float dt, std::vector<NewManifold>& begun) {
  if ((state.flags[c.a] | state.flags[c.b]) & box_changed)
    if (!overlaps(state.fat_boxes[c.a], state.fat_boxes[c.b])) return Change::gone;
  const Change parted = manifold ? Change::ended : Change::nothing;
  if (!overlaps(state.boxes[c.a], state.boxes[c.b])) return parted;

  const Pose b_in_a = relative(state.poses[c.a], state.poses[c.b]);
  if (manifold && moved_little(*manifold, b_in_a, c.recycle_distance)) return Change::recycled;

  const BodyInfo &a = bodies[c.a], &b = bodies[c.b];
  const float margin = speculative_margin(a.radius, b.radius, state.velocities[c.a], state.velocities[c.b], dt);
  const Manifold fresh = collide(a.geometry, b.geometry, b_in_a, margin, c.axis);
  if (fresh.count == 0) return parted;
  if (!manifold) {
    begun.push_back({index, b_in_a, fresh, 0});
    return Change::began;
  }
  set_manifold(*manifold, fresh, b_in_a);
  return Change::nothing;
}

}  // namespace fathom::native
