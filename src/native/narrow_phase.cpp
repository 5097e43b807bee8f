#include "native/narrow_phase.hpp"

#include <bit>

#define HWY_DISABLE_PCLMUL_AES
#include <hwy/highway.h>

#include "check/check.hpp"
#include "collision/box_box.hpp"
#include "dynamics/manifold_update.hpp"
#include "native/pieces.hpp"
#include "native/prefetch.hpp"
#include "native/tuning.hpp"

namespace fathom::native {

namespace {

namespace hn = hwy::HWY_NAMESPACE;
constexpr hn::CappedTag<float, 4> d;

/// By axis; the fourth lane is always true. Comparing all axes avoids unpredictable branches. Another float must follow
/// each box in memory.
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

/// Once the overlap with which two bodies began has faded, their manifold may be recycled again.
void forget_overlap(Contact& c, Children children, const BodyTable& bodies) {
  if (!c.slack.recycles() && !c.slack.is_lifted() && c.slack.overlap() < overlap_gone)
    c.slack = Slack::of_distance(recycle_distance(c, children, bodies));
}

void prefetch_for(const Contact& c, const ContactManifold* manifolds, const BodyState& state) {
  if (!c.in_use) return;
  for (const std::uint32_t slot : {c.a, c.b}) {
    prefetch_to_read(&state.bounds[slot]);
    prefetch_to_read(&state.poses[slot]);
  }
  if (c.touching()) {
    // `moved_little` reads three of the four cache lines.
    const ContactManifold& m = manifolds[c.manifold];
    prefetch_to_read(&m.points[0].anchor_b);
    prefetch_to_read(&m.points[2].anchor_b);
    prefetch_to_read(&m.rotation_at_build.z);
  } else {
    for (const std::uint32_t slot : {c.a, c.b}) prefetch_to_read(&state.velocities[slot]);
  }
}

/// Writes only on change: the solving threads have contacts in their caches, too.
void put(AxisCache& to, const AxisCache& axis) {
  if (std::bit_cast<std::uint32_t>(to) != std::bit_cast<std::uint32_t>(axis)) to = axis;
}

// Few manifolds are reduced: kept out of line, so that they take no registers from the common path.
HWY_NOINLINE bool is_to_reduce(AxisCache& cache, const ContactManifold& m) { return is_to_reduce_anew(cache, m); }
HWY_NOINLINE void find_load(const ContactManifold& m, PatchLoad& load) { load = load_of(m); }

constexpr std::uint32_t prefetch_distance = 16;  // contacts

/// Uninitialised storage for one item per contact of a chunk.
template <class T>
struct Unset {
  union {
    T items[contact_grain];
  };
  Unset() {}
};

}  // namespace

// Out of line, away from contacts whose distance is stored.
HWY_NOINLINE float recycle_distance(const Contact& c, Children children, const BodyTable& bodies) {
  const Piece a = piece_of(bodies[c.a], children.a), b = piece_of(bodies[c.b], children.b);
  return fathom::recycle_distance(a.geometry.type, a.radius, b.geometry.type, b.radius);
}

HWY_FLATTEN Inspection inspect_contact(Contact& c, const ContactManifold* manifold, const BodyTable& bodies,
                                       const BodyState& state, float dt, Children children) {
  const BodyBounds &a = state.bounds[c.a], &b = state.bounds[c.b];
  if (have_parted(a, b, state.flags[c.a] | state.flags[c.b])) return {Change::gone};
  if (!hn::AllTrue(d, overlaps_by_axis(a.box, b.box))) return {manifold ? Change::ended : Change::nothing};

  const Pose b_in_a = relative(state.poses[c.a], state.poses[c.b]);
  const bool is_reduced = manifold && c.axis.reduced;
  if (manifold && !c.ahead && moved_little(*manifold, b_in_a, kept_within(c, children, bodies)) &&
      !(is_reduced && is_to_reduce(c.axis, *manifold)))
    return {Change::recycled};

  if (manifold) prefetch_to_write(manifold);  // its first line: the others have been read
  forget_overlap(c, children, bodies);
  const float margin = speculative_margin(a.radius, b.radius, state.velocities[c.a], state.velocities[c.b], dt);
  Inspection seen{Change::nothing, true, margin, b_in_a, {}};
  if (is_reduced) find_load(*manifold, seen.load);
  return seen;
}

Change NarrowPhase::put(std::uint32_t index, Contact& c, const Manifold& fresh, const Pose& b_in_a, float ahead,
                        ContactManifold* manifold) const {
  if (fresh.count == 0) return manifold ? Change::ended : Change::nothing;
  if (!manifold) {
    begun.push_back({index, ahead, b_in_a, fresh});
    return Change::began;
  }
  FATHOM_ASSERT(!c.round || fresh.count <= 2);  // rolling data occupies the other points' memory
  set_manifold(*manifold, fresh, b_in_a, c.axis.reduced);
  if (c.axis.reduced) c.axis.wait = steps_to_settle;
  if (c.ahead != (ahead >= 0)) c.ahead = ahead >= 0;
  if (c.ahead) manifold->step_impulse = ahead;
  return Change::nothing;
}

HWY_NOINLINE Change NarrowPhase::put_at_seam(std::uint32_t index, Contact& c, const Manifold& fresh, const Pose& b_in_a,
                                             float ahead, ContactManifold* manifold) const {
  const Piece a = piece_of(bodies[c.a], 0), b = piece_of(bodies[c.b], 0);
  const float margin = speculative_margin(a.radius, b.radius, state.velocities[c.a], state.velocities[c.b], dt);
  return put(index, c, seams.kept({c.a, 0, a}, {c.b, 0, b}, b_in_a, margin, fresh).manifold, b_in_a, ahead, manifold);
}

Change NarrowPhase::take(std::uint32_t index, Contact& c, const Manifold& fresh, const Inspection& seen,
                         ContactManifold* manifold) const {
  // The bounds of boxes suffice to tell that they are slow: no need for BodyInfo.
  const BodyBounds &a = state.bounds[c.a], &b = state.bounds[c.b];
  const float half = min(min_component(a.half_extents), min_component(b.half_extents));
  // A box may be thicker than the shape in it: half the depth.
  const bool may_be_pressed = c.fixed_a && is_pressed(fresh, 0.5f * half);
  if (!may_be_pressed && movement_of(seen.margin, a.radius, b.radius, dt) <= max(slow_movement, slow_share * half))
    return put_kept(index, c, fresh, seen.b_in_a, -1, manifold);
  if (!c.fixed_a && pass_for_certain(fresh, c.axis, state.velocities[c.a], state.velocities[c.b], dt))
    return put(index, c, {}, seen.b_in_a, -1, manifold);
  return take_fast(index, c, fresh, seen, manifold);
}

Change update_contact(std::uint32_t index, Contact& c, ContactManifold* manifold, const NarrowPhase& narrow_phase) {
  const auto& [bodies, state, dt, begun, fast, graph, ended, gone, has_new_parts, seams] = narrow_phase;
  if (c.in_parts) return update_parts(index, narrow_phase);
  const Inspection seen = inspect_contact(c, manifold, bodies, state, dt, {});
  if (!seen.collide) return seen.change;
  const BodyBounds &a = state.bounds[c.a], &b = state.bounds[c.b];
  AxisCache axis = c.axis;
  const Manifold fresh =
      a.is_box() && b.is_box()
          ? collide_boxes(a.half_extents, b.half_extents, seen.b_in_a, seen.margin, axis, seen.load)
          : collide(bodies[c.a].geometry, bodies[c.b].geometry, seen.b_in_a, seen.margin, axis, seen.load);
  put(c.axis, axis);
  return narrow_phase.take(index, c, fresh, seen, manifold);
}

void update_contacts(std::span<Contact> contacts, std::uint32_t first, std::uint32_t end, ContactManifold* manifolds,
                     const NarrowPhase& narrow_phase, Change* changes) {
  const auto& [bodies, state, dt, begun, fast, graph, ended, gone, has_new_parts, seams] = narrow_phase;
  enum class Todo : std::uint8_t { nothing, collide, everything };
  Todo todo[contact_grain] = {};
  bool any_others = false;
  BoxPairs pairs;  // boxes without a manifold: most pairs are apart
  std::uint32_t contact_of[contact_grain], entry_of[contact_grain];
  Unset<AxisCache> caches;
  for (std::uint32_t i = first; i < end; ++i) {
    if (i + prefetch_distance < contacts.size()) prefetch_for(contacts[i + prefetch_distance], manifolds, state);
    Contact& c = contacts[i];
    Change& change = changes[i - first] = Change::nothing;
    if (!c.is_pair()) continue;
    const std::uint8_t flags = state.flags[c.a] | state.flags[c.b];
    if (!(flags & awake)) continue;
    if (c.touching()) {
      change = update_contact(i, c, &manifolds[c.manifold], narrow_phase);
      continue;
    }
    const BodyBounds &a = state.bounds[c.a], &b = state.bounds[c.b];
    const bool parted = have_parted(a, b, flags), meet = hn::AllTrue(d, overlaps_by_axis(a.box, b.box));
    const int is_box_a = a.is_box(), is_box_b = b.is_box(), together = !parted, near = meet;
    const int boxes = is_box_a & is_box_b, collide = together & near;
    if (parted) change = Change::gone;
    // Other parts may have a manifold even if the first has none.
    if (c.in_parts) [[unlikely]]
      todo[i - first] = Todo::everything, any_others = true;
    if (!boxes && collide) todo[i - first] = Todo::everything, any_others = true;
    // Branch-free: the outcome is unpredictable.
    contact_of[pairs.count] = i;
    pairs.a[pairs.count] = c.a;
    pairs.b[pairs.count] = c.b;
    caches.items[pairs.count] = c.axis;
    pairs.count += static_cast<std::size_t>(boxes & collide);
  }

  if (pairs.count == 0 && !any_others) return;

  Unset<Pose> b_in_a;
  const std::uint32_t apart = separate_boxes(pairs, dt, state, b_in_a.items, caches.items);
  for (std::uint32_t k = 0; k < pairs.count; ++k) {
    Contact& c = contacts[contact_of[k]];
    put(c.axis, caches.items[k]);
    forget_overlap(c, {}, bodies);
    entry_of[contact_of[k] - first] = k;
    if (!(apart >> k & 1)) todo[contact_of[k] - first] = Todo::collide;
  }

  // New manifolds are listed in the order of contacts.
  for (std::uint32_t i = first; i < end; ++i) {
    if (todo[i - first] == Todo::nothing) continue;
    Contact& c = contacts[i];
    if (todo[i - first] == Todo::everything) {
      changes[i - first] = update_contact(i, c, nullptr, narrow_phase);
      continue;
    }
    const BodyBounds &a = state.bounds[c.a], &b = state.bounds[c.b];
    const float margin = speculative_margin(a.radius, b.radius, state.velocities[c.a], state.velocities[c.b], dt);
    const Pose& pose = b_in_a.items[entry_of[i - first]];
    AxisCache axis = c.axis;
    const Manifold fresh = collide_boxes(a.half_extents, b.half_extents, pose, margin, axis);
    put(c.axis, axis);
    changes[i - first] = narrow_phase.take(i, c, fresh, {Change::nothing, true, margin, pose, {}}, nullptr);
  }
}

}  // namespace fathom::native
