// update_manifolds: every contact's manifold at the current poses, and contacts that begin and end.
//
// Two passes: the first checks every contact and filters out the many that need no collision test (boxes apart,
// manifold recycled); the second runs the collision functions over lists of the others, one per `ShapePair`.
#pragma once

#include "collision/collide.hpp"
#include "device/constraint_rows.hpp"
#include "device/contact_arrays.hpp"
#include "device/find_pairs.hpp"
#include "device/joint_arrays.hpp"
#include "device/pieces.hpp"
#include "device/seams.hpp"
#include "dynamics/look_ahead.hpp"
#include "dynamics/manifold_update.hpp"
#include "dynamics/overlap.hpp"
#include "exec/atomic.hpp"
#include "exec/group.hpp"
#include "exec/kernel.hpp"
#include "math/team.hpp"

namespace fathom::device {

/// Supports of body i are searched in this same step.
template <BodyPart... written>
FATHOM_HD void hold_at_once(const Bodies<written...>& bodies, std::uint32_t i, Counters& counters) {
  exec::atomic_store(bodies.support[i].overloaded, counters.step);
  exec::atomic_store(bodies.support[i].held, was_placed);
  exec::atomic_store(counters.overloaded_step, counters.step);
}

/// The changes that all passes make when a contact begins or ends.
struct ContactChanges {
  Bodies<body_colours, body_islands, body_fast_pairs, body_supports> bodies;
  ContactArrays contacts;
  ApartTable apart;
  Counters* counters;
  float sag;  ///< s²: `contact_sag`

  /// All bodies asleep with body `i` wake before constraints are built.
  FATHOM_HD void wake(std::uint32_t i) const {
    if (bodies.flags[i] & (awake_flag | isolated_flag) || !bodies.constants[i].is_dynamic()) return;
    exec::atomic_store(bodies.island_woken[bodies.island[i]], counters->step + 1);
    exec::atomic_store(counters->waking, counters->live_bodies);
  }

  /// After a change of its bodies' joints, a contact is disabled by a joint that keeps them apart, or gives up a colour
  /// that a joint has taken.
  FATHOM_HD void meet_joints(Contact& c) const {
    if (apart.has(c.a, c.b)) {
      if (c.touching()) end(c);
      c.bits |= apart_bit;
      return;
    }
    c.bits &= ~apart_bit;
    if (c.fixed_a() || c.colour() >= dynamic_colours) return;
    const std::uint64_t bit = std::uint64_t{1} << c.colour();
    if ((bodies.joint_colours[c.a] | bodies.joint_colours[c.b]) & bit) give_colour_back(c);
  }

  FATHOM_HD void give_colour_back(Contact& c) const {
    if (c.colour() == overflow_colour) return;
    const std::uint64_t bit = std::uint64_t{1} << c.colour() % further_colour;
    std::uint64_t* const taken = c.colour() < further_colour ? bodies.colours : bodies.further;
    const auto give_back = [&](std::uint32_t i) {
      if (apart.is_on && c.colour() < further_colour && bodies.joint_colours[i] & bit) return;  // taken by a joint
      // Only this contact holds the bit, so subtracting clears it.
      exec::atomic_add(taken[i], ~bit + 1);
    };
    give_back(c.b);
    if (!c.fixed_a()) give_back(c.a);
    c.set_colour(overflow_colour);
  }

  FATHOM_HD void end(Contact& c) const {
    give_colour_back(c);
    exec::atomic_add(bodies.touching[c.b], ~0u);
    if (!c.fixed_a()) exec::atomic_add(bodies.touching[c.a], ~0u);
    if (c.in_touch()) contacts.note_touch(c, false, *counters);
    c.bits &= ~(touching_bit | hits_bit);
    contacts.free_manifolds[counters->free_manifolds + exec::atomic_add(counters->freed_manifolds, 1u)] = c.manifold;
    c.manifold = none;
    exec::atomic_store(counters->any_ended, 1u);
    exec::atomic_store(counters->layout_dirty, 1u);
  }

  /// A slot for the manifold of a contact that begins, or `none` if there is no room.
  FATHOM_HD std::uint32_t take_manifold() const {
    return manifold_slot(exec::atomic_add(counters->taken_manifolds, 1u));
  }
  /// The k-th slot of those that this step's beginning contacts take, or `none` if there is no room.
  FATHOM_HD std::uint32_t manifold_slot(std::uint32_t k) const {
    const std::uint32_t free = counters->free_manifolds;
    if (k < free) return contacts.free_manifolds[free - 1 - k];
    const std::uint32_t slot = counters->manifolds + (k - free);
    return slot < contacts.manifold_capacity ? slot : none;
  }

  FATHOM_HD void begin(std::uint32_t index, Contact& c, const ContactManifold& m) const {
    c.bits |= touching_bit;
    exec::atomic_add(bodies.touching[c.b], 1u);
    if (!c.fixed_a()) exec::atomic_add(bodies.touching[c.a], 1u);
    find_colour(index);
    exec::atomic_store(counters->any_began, 1u);
    exec::atomic_store(counters->layout_dirty, 1u);
    if (asks(bodies, c))
      c.bits |= unanswered_bit;
    else
      begin_between(c, m);
  }
  /// What a contact that begins does to its bodies.
  FATHOM_HD void begin_between(const Contact& c, const ContactManifold& m) const {
    if (!c.fixed_a() && is_placed(m, c)) look_for_supports(c);
    wake(c.a);
    wake(c.b);
  }

  /// The largest friction of piece i in any direction.
  FATHOM_HD float largest_friction(std::uint32_t i) const {
    const BodyConstants& body = bodies.constants[i];
    return body.has_friction_axis() ? max(body.friction, bodies.traits[i].friction_along) : body.friction;
  }
  /// Without its surface velocity; the friction is the largest in any direction.
  FATHOM_HD Material material_of(std::uint32_t i) const {
    const BodyConstants& body = bodies.constants[i];
    return {largest_friction(i), body.restitution, body.friction_rule(), body.restitution_rule(),
            bodies.tensors[i].rolling_resistance};
  }
  FATHOM_HD void mix(Contact& c, ContactManifold& m) const {
    const TouchingPieces pieces = pieces_of(bodies, c);
    const BodyConstants &a = bodies.constants[pieces.a], &b = bodies.constants[pieces.b];
    const Material* const own = own_material(bodies, c);
    Material of_a = own ? *own : material_of(pieces.a);
    if (own) of_a.friction = friction_of(*own, {}).largest();
    const Material of_b = material_of(pieces.b);
    m.friction = combine(of_a.friction, of_b.friction, of_a.friction_rule, of_b.friction_rule);
    m.restitution = combine(of_a.restitution, of_b.restitution, of_a.restitution_rule, of_b.restitution_rule);
    if (m.restitution > 0) exec::atomic_store(counters->may_bounce, 1u);
    c.bits &= ~static_cast<std::uint32_t>(on_moving_surface_bit | by_direction_bit | own_slide_bit);
    const bool a_moves = own ? !(own->surface_velocity == Vec3{}) : a.has_moving_surface();
    if (a_moves || b.has_moving_surface()) c.bits |= on_moving_surface_bit;
    const bool a_has_axis = own ? !(own->friction_axis == Vec3{}) : a.has_friction_axis();
    if (a_has_axis || b.has_friction_axis()) c.bits |= by_direction_bit;
    if (!c.round()) return;
    const auto radius = [](const BodyConstants& body) { return is_round(body.shape()) ? body.shape_radius : 0.0f; };
    set_round(m, radius(a), radius(b), of_a.rolling_resistance, of_b.rolling_resistance);
  }

  /// Updates the contact `c`, a copy, to the collision result `fresh` of its pieces, made `time` (s) after the step's
  /// beginning or, if negative, at the current poses. False: it would begin, but there is no room.
  FATHOM_HD bool take(std::uint32_t index, Contact& c, const Manifold& fresh, const Pose& b_in_a, float time) const {
    if (!c.in_parts()) return take_of_bodies(index, c, fresh, b_in_a, time);
    const TouchingPieces pieces = pieces_of(bodies, c);
    const Pose a = pose_in_body(bodies, pieces.a), b = pose_in_body(bodies, pieces.b);
    return take_of_bodies(index, c, in_frame(a, fresh), a * b_in_a * relative(b, {}), time);
  }

  /// The contact begins, or has found no colour so far. Only once per step.
  FATHOM_HD void find_colour(std::uint32_t index) const {
    contacts.uncoloured[0][exec::atomic_add(counters->uncoloured[0], 1u)] = index;
  }

  /// Calls act(index, contact) for the patches of a pair with a surface.
  template <class Act>
  FATHOM_HD void for_each_patch(const Contact& pair, const Act& act) const {
    for (std::uint32_t index = pair.manifold; index != none;) {
      Contact& patch = contacts.contacts[index];
      const std::uint32_t next = patch.next_patch();
      act(index, patch);
      index = next;
    }
  }

  /// The end poses of the pair's bodies will be looked at after the step; entry `pair` of `fast` is theirs.
  FATHOM_HD void watch(std::uint32_t pair, const Contact& c) const {
    note_begin(c.a);
    note_begin(c.b);
    contacts.fast[pair].next = chained(pair, c.b);
    if (!c.fixed_a()) contacts.next_of_a[pair] = chained(pair, c.a);
  }

  /// The pair is fast, or may touch at a seam.
  FATHOM_HD void look_ahead(std::uint32_t index, bool has_hull) const {
    contacts.fast[contacts.fast_at(has_hull, exec::atomic_add(counters->fast[has_hull], 1u))] = {index, none};
  }

  /// The contact would begin, but there was no room for its manifold.
  FATHOM_HD void defer(std::uint32_t index, ShapePair pairs) const {
    contacts.deferred[contacts.listed(pairs, exec::atomic_add(counters->deferred[pairs], 1u))] = index;
  }

  FATHOM_HD float half_of_thinner(const TouchingPieces& pieces) const {
    return min(half_thickness(bodies.constants[pieces.a]), half_thickness(bodies.constants[pieces.b]));
  }

  /// Updates the contact `c`, a copy, which has room for its manifold, to the result `fresh`, with points and in the
  /// frames of its bodies. `begins`: it did not touch before.
  FATHOM_HD void put(std::uint32_t index, Contact& c, const Manifold& fresh, const Pose& b_in_a, float time,
                     bool begins) const {
    const bool is_ahead = time >= 0;
    ContactManifold& m = contacts.manifolds[c.manifold];
    if (begins) {
      m = ContactManifold{};
      const TouchingPieces pieces = pieces_of(bodies, c);
      const BodyConstants &a = bodies.constants[pieces.a], &b = bodies.constants[pieces.b];
      if (is_round(a.shape()) || is_round(b.shape())) c.bits |= round_bit;
      mix(c, m);
      c.offset = first_overlap(fresh, m.restitution, half_thickness(a), half_thickness(b),
                               sag * length(counters->gravity), c.in_parts());
    }
    if (is_ahead) c.offset = 0;
    c.bits = is_ahead ? c.bits | ahead_bit : c.bits & ~ahead_bit;
    set_manifold(m, fresh, b_in_a, c.axis.reduced);
    if (c.axis.reduced) c.axis.wait = steps_to_settle;
    if (is_ahead) m.step_impulse = time;
    if (begins) begin(index, c, m);
    contacts.contacts[index] = c;
  }

 private:
  /// `take`, in the frames of the bodies.
  FATHOM_HD bool take_of_bodies(std::uint32_t index, Contact& c, const Manifold& fresh, const Pose& b_in_a,
                                float time) const {
    if (fresh.count == 0) {
      if (c.touching()) end(c);
      contacts.contacts[index] = c;
      return true;
    }
    const bool begins = !c.touching();
    if (begins) c.manifold = take_manifold();
    if (c.manifold == none) return false;
    put(index, c, fresh, b_in_a, time, begins);
    return true;
  }

  FATHOM_HD void note_begin(std::uint32_t body) const {
    const Pose& pose = bodies.poses[body];
    bodies.before[body] = {pose.position, 0, pose.rotation};
  }
  /// Puts the pair at the head of the body's chain and returns the former head. Results do not depend on the order.
  FATHOM_HD std::uint32_t chained(std::uint32_t pair, std::uint32_t body) const {
    const std::uint32_t next = exec::atomic_exchange(bodies.fast_pair[body], pair);
    if (next == none) bodies.fast[exec::atomic_add(counters->fast_bodies, 1u)] = body;
    return next;
  }

  /// Whether a contact touches as soon as it begins, because a body was placed there: contacts of approaching bodies
  /// begin earlier. Not for deep penetration, which is pushed out.
  FATHOM_HD bool is_placed(const ContactManifold& m, const Contact& c) const {
    constexpr float deep = 0.01f;  // m
    const Pose &a = bodies.poses[c.a], &b = bodies.poses[c.b];
    float nearest = 1, reach = 0;
    const Vec3 normal = rotate(a.rotation, m.normal), between = b.position - a.position;
    for (int i = 0; i < m.point_count(); ++i) {
      const Vec3 arm = rotate(b.rotation, m.points[i].anchor_b);
      nearest = min(nearest, dot(between + arm - rotate(a.rotation, m.points[i].anchor_a), normal));
      reach = support_reach(arm);
    }
    return nearest <= reach && nearest > -deep;
  }
  /// A placed body has no known load yet: it is held in its first step; from then on its impulses decide.
  FATHOM_HD void look_for_supports(const Contact& c) const {
    hold_at_once(bodies, c.a, *counters);
    hold_at_once(bodies, c.b, *counters);
  }
};

/// First pass: lists the contacts that have to collide.
struct SortOutContacts {
  static constexpr std::uint32_t group_size = 128;

  struct Local {
    std::uint32_t count[shape_pairs];  // that have to collide
    std::uint32_t first[shape_pairs];
    std::uint32_t recycled;
  };

  ContactChanges changes;

  FATHOM_HD void operator()(auto group, Local& local) const {
    Counters& counters = *changes.counters;
    group.once([&] {
      for (std::uint32_t& count : local.count) count = 0;
      local.recycled = 0;
    });
    auto kind = per_item<std::uint32_t>(group);
    auto rank = per_item<std::uint32_t>(group);
    group.for_each([&](std::uint32_t item) {
      const std::uint32_t index = group.index() * group_size + item;
      kind[item] = index < counters.live_contacts ? look_at(index) : nothing;
      if (kind[item] < nothing) rank[item] = exec::atomic_add(local.count[kind[item]], 1u);
      if (kind[item] == recycled) exec::atomic_add(local.recycled, 1u);
    });
    group.once([&] {
      for (std::uint32_t k = 0; k < shape_pairs; ++k)
        if (local.count[k]) local.first[k] = exec::atomic_add(counters.to_collide[k], local.count[k]);
      if (local.recycled) exec::atomic_add(counters.recycled, local.recycled);
    });
    group.for_each([&](std::uint32_t item) {
      const std::uint32_t index = group.index() * group_size + item;
      if (kind[item] >= nothing) return;
      const auto pairs = static_cast<ShapePair>(kind[item]);
      changes.contacts.to_collide[changes.contacts.listed(pairs, local.first[pairs] + rank[item])] = index;
    });
  }

 private:
  /// Outcomes other than a `ShapePair` that has to collide.
  enum Outcome : std::uint32_t { nothing = shape_pairs, recycled };

  FATHOM_HD std::uint32_t look_at(std::uint32_t index) const {
    const auto& bodies = changes.bodies;
    Contact& c = changes.contacts.contacts[index];
    if (!c.in_use() || c.is_patch()) return nothing;
    if (c.is_with_surface()) return look_at_surface(index, c);
    const TouchingPieces pieces = pieces_of(bodies, c);
    const NotedBox fat_a = bodies.fat[pieces.a], fat_b = bodies.fat[pieces.b];
    const std::uint32_t noted = fat_a.changes | fat_b.changes;
    if (!noted && !((bodies.flags[c.a] | bodies.flags[c.b]) & awake_flag)) return nothing;
    if (noted) {
      if (c.touching() && noted & wake_partners) changes.wake(c.a), changes.wake(c.b);
      const bool fresh = c.bits & fresh_bit;
      c.bits &= ~fresh_bit;
      if ((noted & drop_contacts && !fresh) || !overlaps(fat_a.box(), fat_b.box())) {
        drop(index, c);
        return nothing;
      }
      if (!has_custom_filter(bodies, c)) c.bits &= ~static_cast<std::uint32_t>(kept_out_bit);
      if (changes.apart.is_on && (fresh || noted & joint_change)) changes.meet_joints(c);
      if (c.touching() && noted & mix_materials) changes.mix(c, changes.contacts.manifolds[c.manifold]);
    }
    if (c.apart() || c.kept_out()) return nothing;
    if (!overlaps(bodies.boxes[pieces.a], bodies.boxes[pieces.b])) {
      if (c.touching()) changes.end(c);
      return nothing;
    }
    if (c.touching()) {
      const Pose b_in_a = relative(bodies.poses[c.a], bodies.poses[c.b]);
      if (c.colour() == overflow_colour) changes.find_colour(index);
      const ContactManifold& m = changes.contacts.manifolds[c.manifold];
      if (!c.ahead() && moved_little(m, b_in_a, c.recycle_distance) && !is_to_reduce_anew(c.axis, m)) return recycled;
    }
    return shape_pair(bodies.constants[pieces.a].shape(), bodies.constants[pieces.b].shape());
  }

  /// The same for a pair with a surface and all its patches.
  FATHOM_HD std::uint32_t look_at_surface(std::uint32_t index, Contact& c) const {
    const auto& bodies = changes.bodies;
    const TouchingPieces pieces = pieces_of(bodies, c);
    const NotedBox fat_a = bodies.fat[pieces.a], fat_b = bodies.fat[pieces.b];
    const std::uint32_t noted = fat_a.changes | fat_b.changes;
    if (!noted && !((bodies.flags[c.a] | bodies.flags[c.b]) & awake_flag)) return nothing;
    if (noted) {
      const bool fresh = c.bits & fresh_bit;
      c.bits &= ~fresh_bit;
      const bool is_gone = (noted & drop_contacts && !fresh) || !overlaps(fat_a.box(), fat_b.box());
      changes.for_each_patch(c, [&](std::uint32_t k, Contact& patch) {
        if (patch.touching() && noted & wake_partners) changes.wake(c.b);
        if (patch.touching() && !is_gone && noted & mix_materials)
          changes.mix(patch, changes.contacts.manifolds[patch.manifold]);
        if (is_gone) drop(k, patch);
      });
      if (is_gone) {
        exec::atomic_add(changes.counters->patches, ~0u * patches_per_pair);
        drop(index, c);
        return nothing;
      }
      if (!has_custom_filter(bodies, c)) c.bits &= ~static_cast<std::uint32_t>(kept_out_bit);
      if (changes.apart.is_on && (fresh || noted & joint_change))
        c.bits = changes.apart.has(c.a, c.b) ? c.bits | apart_bit : c.bits & ~apart_bit;
    }
    const bool is_near = !c.apart() && !c.kept_out() && overlaps(bodies.boxes[pieces.a], bodies.boxes[pieces.b]);
    if (!is_near)
      changes.for_each_patch(c, [&](std::uint32_t, Contact& patch) {
        if (patch.touching()) changes.end(patch);
      });
    return is_near ? std::uint32_t{surfaces} : std::uint32_t{nothing};
  }
  FATHOM_HD void drop(std::uint32_t index, Contact& c) const {
    if (c.touching()) changes.end(c);
    c.a = none;
    changes.contacts.free[exec::atomic_add(changes.counters->free_contacts, 1u)] = index;
  }
};

/// Second pass; item k is the k-th of the list of `pairs`. A contact that would begin but finds no room for its
/// manifold is left unchanged and deferred.
template <ShapePair pairs>
struct CollideShapes {
  static constexpr std::uint32_t group_size = 64;  // few heavy items: small groups reach more compute units
  static constexpr bool runs_in_teams = pairs == hulls;

  ContactChanges changes;
  float dt;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const auto& bodies = changes.bodies;
    const auto& contacts = changes.contacts;
    const std::uint32_t index = contacts.to_collide[contacts.listed(pairs, k)];
    Contact c = contacts.contacts[index];
    const TouchingPieces pieces = pieces_of(bodies, c);
    PatchLoad load = c.touching() && c.axis.reduced ? load_of(contacts.manifolds[c.manifold]) : PatchLoad{};
    if (c.in_parts()) load.at = inverse_transform(pose_in_body(bodies, pieces.a), load.at);
    const Pose b_in_a = relative(bodies.poses[pieces.a], bodies.poses[pieces.b]);
    const BodyConstants &a = bodies.constants[pieces.a], &b = bodies.constants[pieces.b];
    const Velocity &velocity_a = bodies.velocities[pieces.a], &velocity_b = bodies.velocities[pieces.b];
    const float margin = speculative_margin(a.radius, b.radius, velocity_a, velocity_b, dt);
    const Manifold fresh = collide(c.axis, pieces, b_in_a, margin, load);
    if constexpr (runs_in_teams) {
      team::sync();
      if (!team::is_leader()) return;
    }
    const float movement = movement_of(margin, a.radius, b.radius, dt);
    const float half = changes.half_of_thinner(pieces);
    const bool is_fast = movement > slow_movement && movement > slow_share * half;
    const bool pressed = c.fixed_a() && is_pressed(fresh, half);
    const bool passes = !c.fixed_a() && pass_for_certain(fresh, c.axis, velocity_a, velocity_b, dt);
    if ((is_fast && !passes) || pressed || is_at_seam(pieces, b_in_a, fresh)) {
      contacts.contacts[index] = c;
      changes.look_ahead(index, pairs == hulls);
    } else if (!changes.take(index, c, fresh, b_in_a, -1)) {
      changes.defer(index, pairs);
    }
  }

 private:
  FATHOM_HD bool is_at_seam(const TouchingPieces& pieces, const Pose& b_in_a, const Manifold& fresh) const {
    return fresh.count > 0 && seams_of(changes.bodies, changes.contacts, dt).may_be_at(pieces, b_in_a, fresh);
  }

  FATHOM_HD Manifold collide(AxisCache& axis, const TouchingPieces& pieces, const Pose& b_in_a, float margin,
                             const PatchLoad& load) const {
    const auto& bodies = changes.bodies;
    const auto [a, b] = pieces;
    if constexpr (pairs == boxes)
      return collide_boxes(bodies.constants[a].half_extents, bodies.constants[b].half_extents, b_in_a, margin, axis,
                           load);
    else if constexpr (pairs == hulls)
      return collide_others(bodies.geometry_for_team(a), bodies.geometry_for_team(b), b_in_a, margin, axis, load);
    else
      return collide_others<false>(bodies.simple_geometry(a), bodies.simple_geometry(b), b_in_a, margin, axis);
  }
};

/// Resumes a step that stopped for lack of manifolds.
struct ResumeStep {
  Counters* counters;
  std::uint32_t contact_group_size;

  FATHOM_HD void operator()(std::uint32_t) const {
    Counters& c = *counters;
    c.stopped = no_stop;
    for (std::uint32_t k = 0; k < shape_pairs; ++k) {
      c.to_collide[k] = c.deferred[k];
      c.deferred[k] = 0;
    }
    c.lacking_manifolds = 0;
    c.live_bodies = c.waking = c.bodies;
    for (std::uint32_t k = 0; k < 2; ++k) c.looked_ahead[k] = c.fast[k];
    c.live_contacts = c.contacts;
    c.contact_groups = (c.contacts + contact_group_size - 1) / contact_group_size;
    c.recolouring = wants_recolouring(c);
  }
};

/// Resumes a step that stopped because a body failed, at the building of constraints.
struct RepeatStep {
  Counters* counters;
  std::uint32_t contact_group_size;

  FATHOM_HD void operator()(std::uint32_t) const {
    Counters& c = *counters;
    c.stopped = no_stop;
    c.live_bodies = c.bodies;
    c.live_contacts = c.contacts;
    c.contact_groups = (c.contacts + contact_group_size - 1) / contact_group_size;
    c.layout_dirty = 1;
    c.recolouring = c.waking = 0;
    c.points = c.islands = c.active = 0;
  }
};

/// Lists the deferred contacts to collide once more.
struct ListDeferred {
  Contacts<contact_worklists> contacts;
  ShapePair pairs;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const std::uint32_t index = contacts.listed(pairs, k);
    contacts.to_collide[index] = contacts.deferred[index];
  }
};

/// Wakes the bodies of islands that are woken in this step.
struct WakeIslands {
  Bodies<body_state, body_supports> bodies;
  Counters* counters;

  FATHOM_HD void operator()(std::uint32_t i) const {
    if (bodies.flags[i] & (awake_flag | isolated_flag) || !bodies.constants[i].is_dynamic()) return;
    if (bodies.island_woken[bodies.island[i]] != counters->step + 1) return;
    bodies.flags[i] |= awake_flag;
    bodies.slow_time[i] = 0;
    if (bodies.support[i].level > 0) hold_at_once(bodies, i, *counters);
    // It wakes with its load.
    if (bodies.support[i].load.inertia_scale > 1) exec::atomic_store(counters->loaded_step, counters->step);
    exec::atomic_store(counters->layout_dirty, 1u);
  }
};

}  // namespace fathom::device
