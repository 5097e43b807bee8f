// Pairs that move fast for their size (dynamics/look_ahead.hpp): few, so lists of their own keep the search for the
// time of impact out of the kernels that every contact goes through.
#pragma once

#include "device/finish.hpp"
#include "device/update_manifolds.hpp"

namespace fathom::device {

/// For a team, if it may be a hull.
template <bool with_hulls>
FATHOM_HD Mover mover(const BodyArrays& bodies, std::uint32_t i, const Pose& pose) {
  return {with_hulls ? bodies.geometry_for_team(i) : bodies.simple_geometry(i), bodies.constants[i].radius, pose,
          bodies.velocities[i]};
}

/// Third pass of the narrow phase; item k is a fast pair with a hull, or one without.
template <bool with_hulls>
struct LookAheadPairs {
  static constexpr std::uint32_t group_size = 64;
  static constexpr bool runs_in_teams = with_hulls;

  ContactChanges changes;
  float dt;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const BodyArrays& bodies = changes.bodies;
    if (k < changes.counters->looked_ahead[with_hulls]) return;
    const std::uint32_t pair = changes.contacts.fast_at(with_hulls, k);
    const std::uint32_t index = changes.contacts.fast[pair].contact;
    Contact c = changes.contacts.contacts[index];
    const Mover a = mover<with_hulls>(bodies, c.a, bodies.poses[c.a]);
    const Mover b = mover<with_hulls>(bodies, c.b, bodies.poses[c.b]);
    const Pose b_in_a = relative(a.pose, b.pose);
    const float margin = speculative_margin(a.radius, b.radius, a.velocity, b.velocity, dt);
    AxisCache axis = c.axis;
    Manifold seen = collide_shapes<with_hulls>(a.geometry, b.geometry, b_in_a, margin, axis);
    const LookAhead found = look_ahead<with_hulls>(a, b, seen, margin, changes.half_of_thinner(c), dt);
    if constexpr (runs_in_teams) {
      team::sync();
      if (!team::is_leader()) return;
    }
    if (found.ahead == Ahead::nothing) seen.count = 0;
    const bool has_room = found.ahead == Ahead::meets ? changes.take(index, c, found.manifold, found.b_in_a, found.time)
                                                      : changes.take(index, c, seen, b_in_a, -1);
    if (!has_room) {
      changes.defer(index, shape_pair(a.geometry.type, b.geometry.type));
    } else if (c.fixed_a()) {
      chain(pair, c, a.pose, b.pose);
    }
  }

 private:
  /// In any order: what comes of them does not depend on it.
  FATHOM_HD void chain(std::uint32_t pair, const Contact& c, const Pose& pose_a, const Pose& pose_b) const {
    changes.bodies.before[c.a] = pose_a;
    changes.bodies.before[c.b] = pose_b;
    changes.contacts.fast[pair].next = exec::atomic_exchange(changes.bodies.fast_pair[c.b], pair);
  }
};

/// What came out inside or behind something that cannot be pushed goes as far as its way was free, and on in the next
/// step. Item k is a fast pair of either list; one of each body's pairs speaks for all, if some is with a hull, the
/// first of those.
template <bool with_hulls>
struct HoldBackFast {
  static constexpr std::uint32_t group_size = 64;
  static constexpr bool runs_in_teams = with_hulls;

  MoveBodies move;
  ContactArrays contacts;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const BodyArrays& bodies = move.bodies;
    if (move.counters->stopped) return;
    const std::uint32_t own = contacts.fast_at(with_hulls, k);
    const std::uint32_t i = contacts.contacts[contacts.fast[own].contact].b;
    const std::uint32_t first = bodies.fast_pair[i];
    if (first == none || speaker(first) != own) return;
    sync();
    if (leads()) bodies.fast_pair[i] = none;
    if ((bodies.flags[i] & (awake_flag | isolated_flag)) != awake_flag) return;
    bool is_free = true;
    // In the order of what they meet: that of the list is any.
    for (std::uint32_t pair = next_after(none, first); pair != none;) {
      const Contact& c = contacts.contacts[contacts.fast[pair].contact];
      const FreeWay way = free_way_of(c);
      if (!way.is_free) {
        is_free = false;
        const Pose end = end_of(way, bodies.before[i], bodies.poses[i], move.p.dt);
        sync();
        if (leads()) {
          if (c.touching()) contacts.manifolds[c.manifold].forget_build();
          Velocity& v = bodies.velocities[i];
          v.linear = limited(way.linear, move.p.limits.linear);
          if (!bodies.constants[i].is_isotropic())
            v.angular = spin_put_back(v.angular, bodies.poses[i].rotation, end.rotation);
          bodies.poses[i] = end;
        }
        sync();
      }
      pair = next_after(c.a, first);
    }
    if (!is_free && leads()) put_box(i);
  }

 private:
  FATHOM_HD static void sync() {
    if constexpr (runs_in_teams) team::sync();
  }
  FATHOM_HD static bool leads() { return !runs_in_teams || team::is_leader(); }

  /// Of the pairs from `first` on the first with a hull, or else the first.
  FATHOM_HD std::uint32_t speaker(std::uint32_t first) const {
    const std::uint32_t first_with_hull = contacts.capacity - move.counters->fast[true];
    for (std::uint32_t pair = first; pair != none; pair = contacts.fast[pair].next)
      if (pair >= first_with_hull) return pair;
    return first;
  }

  /// The pair, of those from `first` on, with the lowest A above `last` (`none`: any).
  FATHOM_HD std::uint32_t next_after(std::uint32_t last, std::uint32_t first) const {
    std::uint32_t best = none, lowest = none;
    for (std::uint32_t pair = first; pair != none; pair = contacts.fast[pair].next) {
      const std::uint32_t a = contacts.contacts[contacts.fast[pair].contact].a;
      if ((last == none || a > last) && a < lowest) best = pair, lowest = a;
    }
    return best;
  }

  FATHOM_HD FreeWay free_way_of(const Contact& c) const {
    const BodyArrays& bodies = move.bodies;
    const Mover a = mover<with_hulls>(bodies, c.a, bodies.before[c.a]);
    const Mover b = mover<with_hulls>(bodies, c.b, bodies.before[c.b]);
    const float half =
        min(ContactChanges::thickness(bodies.constants[c.a]), ContactChanges::thickness(bodies.constants[c.b]));
    const Pose &end_a = bodies.poses[c.a], &end_b = bodies.poses[c.b];
    const Mover was_a{a.geometry, a.radius, a.pose, velocity_between(a.pose, end_a, move.p.dt)};
    const Mover was_b{b.geometry, b.radius, b.pose, velocity_between(b.pose, end_b, move.p.dt)};
    AxisCache axis;
    const float margin = speculative_margin(a.radius, b.radius, was_a.velocity, was_b.velocity, move.p.dt);
    const Manifold seen = collide_shapes<with_hulls>(a.geometry, b.geometry, relative(a.pose, b.pose), margin, axis);
    const float skin = skin_of(a, b, half);
    const Apart first = apart_at_first(a, b, near_cores(was_a, was_b, move.p.dt, skin), seen, skin);
    return free_way<with_hulls>(a, b, end_a, end_b, first, half, move.p.dt);
  }

  /// What the body's new pose leaves its boxes.
  FATHOM_HD void put_box(std::uint32_t i) const {
    const BodyArrays& bodies = move.bodies;
    const Pose& pose = bodies.poses[i];
    const Velocity& v = bodies.velocities[i];
    const float radius = bodies.constants[i].radius;
    const Aabb box = motion_box(bodies.geometry(i), radius, pose, v, move.p.dt);
    bodies.boxes[i] = box;
    if (!contains(bodies.fat[i].box(), box)) move.put_fat_box(i, fat_box(radius, box, v.linear, move.p.dt), box_change);
  }
};

}  // namespace fathom::device
