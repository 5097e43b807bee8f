#include "native/narrow_phase.hpp"

#define HWY_DISABLE_PCLMUL_AES
#include <hwy/highway.h>

#include "collision/box_box.hpp"
#include "dynamics/manifold_update.hpp"

namespace fathom::native {

namespace {

namespace hn = hwy::HWY_NAMESPACE;
constexpr hn::CappedTag<float, 4> d;

/// True by axis and, in the fourth lane, always: nobody could predict branches. The boxes are followed by another float.
hn::Mask<decltype(d)> overlaps_by_axis(const Aabb& a, const Aabb& b) {
  const auto is_within = [](const Vec3& lower, const Vec3& upper) {
    return hn::Le(hn::LoadU(d, &lower.x), hn::LoadU(d, &upper.x));
  };
  return hn::Or(hn::And(is_within(a.lower, b.upper), is_within(b.lower, a.upper)), hn::Not(hn::FirstN(d, 3)));
}

bool have_parted(const BodyBounds& a, const BodyBounds& b, std::uint8_t flags) {
  const hn::RebindToSigned<decltype(d)> di;
  const auto same_boxes = hn::RebindMask(d, hn::Eq(hn::Set(di, flags & box_changed), hn::Zero(di)));
  return !hn::AllTrue(d, hn::Or(same_boxes, overlaps_by_axis(a.fat_box, b.fat_box)));
}

}  // namespace

float recycle_distance(const BodyInfo& a, const BodyInfo& b) {
  return fathom::recycle_distance(a.shape.type, a.radius, b.shape.type, b.radius);
}

Inspection inspect_contact(Contact& c, const ContactManifold* manifold, const BodyTable& bodies, const BodyState& state,
                           float dt) {
  const BodyBounds &a = state.bounds[c.a], &b = state.bounds[c.b];
  if (have_parted(a, b, state.flags[c.a] | state.flags[c.b])) return {Change::gone};
  if (!hn::AllTrue(d, overlaps_by_axis(a.box, b.box))) return {manifold ? Change::ended : Change::nothing};

  const Pose b_in_a = relative(state.poses[c.a], state.poses[c.b]);
  if (manifold && moved_little(*manifold, b_in_a, max(c.recycle_distance, 0.0f))) return {Change::recycled};

  constexpr float faded = 1e-7f;  // m
  if (c.recycle_distance <= 0 && c.overlap() < faded) c.recycle_distance = recycle_distance(bodies[c.a], bodies[c.b]);
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
  const BodyBounds &a = state.bounds[c.a], &b = state.bounds[c.b];
  const Manifold fresh = a.is_box() && b.is_box()
                             ? collide_boxes(a.half_extents, b.half_extents, seen.b_in_a, seen.margin, c.axis)
                             : collide(bodies[c.a].geometry, bodies[c.b].geometry, seen.b_in_a, seen.margin, c.axis);
  return take_manifold(index, fresh, seen.b_in_a, manifold, begun);
}

}  // namespace fathom::native
