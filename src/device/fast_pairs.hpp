// Pairs that move fast for their size (dynamics/look_ahead.hpp): few, so lists of their own keep the search for the
// time of impact out of the kernels that every contact goes through.
#pragma once

#include "device/finish.hpp"
#include "device/update_manifolds.hpp"

namespace fathom::device {

FATHOM_HD Mover mover(const BodyArrays& bodies, std::uint32_t i, const Pose& pose) {
  return {bodies.geometry(i), bodies.constants[i].radius, pose, bodies.velocities[i]};
}

/// Third pass of the narrow phase; item k is a contact of the list `fast`.
struct LookAheadPairs {
  static constexpr std::uint32_t group_size = 64;

  ContactChanges changes;
  float dt;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const BodyArrays& bodies = changes.bodies;
    Counters& counters = *changes.counters;
    if (k < counters.looked_ahead) return;
    const std::uint32_t index = changes.contacts.fast[k].contact;
    Contact c = changes.contacts.contacts[index];
    const Mover a = mover(bodies, c.a, bodies.poses[c.a]), b = mover(bodies, c.b, bodies.poses[c.b]);
    const Pose b_in_a = relative(a.pose, b.pose);
    const float margin = speculative_margin(a.radius, b.radius, a.velocity, b.velocity, dt);
    AxisCache axis = c.axis;
    Manifold seen = collide_shapes(a.geometry, b.geometry, b_in_a, margin, axis);
    const LookAhead found = look_ahead(a, b, seen, margin, changes.half_of_thinner(c), dt);
    if (found.ahead == Ahead::nothing) seen.count = 0;
    const bool has_room = found.ahead == Ahead::meets ? changes.take(index, c, found.manifold, found.b_in_a, found.time)
                                                      : changes.take(index, c, seen, b_in_a, -1);
    if (!has_room) {
      const bool boxes = a.geometry.type == ShapeType::box && b.geometry.type == ShapeType::box;
      const std::uint32_t place = exec::atomic_add(counters.deferred[boxes ? 0 : 1], 1u);
      changes.contacts.found[boxes ? place : changes.contacts.capacity - 1 - place] = {index, none};
    } else if (c.fixed_a()) {
      chain(k, c, a.pose, b.pose);
    }
  }

 private:
  /// In any order: what comes of them does not depend on it.
  FATHOM_HD void chain(std::uint32_t k, const Contact& c, const Pose& pose_a, const Pose& pose_b) const {
    changes.bodies.before[c.a] = pose_a;
    changes.bodies.before[c.b] = pose_b;
    changes.contacts.fast[k].next = exec::atomic_exchange(changes.bodies.fast_pair[c.b], k);
  }
};

/// What came out inside or behind something that cannot be pushed goes as far as its way was free, and on in the next
/// step. Item k is a pair of the list `fast`; the first of its body's speaks for all.
struct HoldBackFast {
  static constexpr std::uint32_t group_size = 64;

  MoveBodies move;
  ContactArrays contacts;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const BodyArrays& bodies = move.bodies;
    if (move.counters->stopped) return;
    const std::uint32_t i = contacts.contacts[contacts.fast[k].contact].b;
    if (bodies.fast_pair[i] != k) return;
    bodies.fast_pair[i] = none;
    if ((bodies.flags[i] & (awake_flag | isolated_flag)) != awake_flag) return;
    bool is_free = true;
    // In the order of what they meet: that of the list is any.
    for (std::uint32_t pair = next_after(none, k); pair != none;) {
      const Contact& c = contacts.contacts[contacts.fast[pair].contact];
      const FreeWay way = free_way_of(c);
      if (!way.is_free) {
        is_free = false;
        if (c.touching()) contacts.manifolds[c.manifold].forget_build();
        bodies.poses[i] = end_of(way, bodies.before[i], bodies.poses[i], move.p.dt);
        bodies.velocities[i].linear = limited(way.linear, move.p.limits.linear);
      }
      pair = next_after(c.a, k);
    }
    if (!is_free) put_box(i);
  }

 private:
  /// The pair, of those from the k-th on, with the lowest A above `last` (`none`: any).
  FATHOM_HD std::uint32_t next_after(std::uint32_t last, std::uint32_t k) const {
    std::uint32_t best = none, lowest = none;
    for (std::uint32_t pair = k; pair != none; pair = contacts.fast[pair].next) {
      const std::uint32_t a = contacts.contacts[contacts.fast[pair].contact].a;
      if ((last == none || a > last) && a < lowest) best = pair, lowest = a;
    }
    return best;
  }

  FATHOM_HD FreeWay free_way_of(const Contact& c) const {
    const BodyArrays& bodies = move.bodies;
    const Mover a = mover(bodies, c.a, bodies.before[c.a]), b = mover(bodies, c.b, bodies.before[c.b]);
    const float half =
        min(ContactChanges::thickness(bodies.constants[c.a]), ContactChanges::thickness(bodies.constants[c.b]));
    const Pose &end_a = bodies.poses[c.a], &end_b = bodies.poses[c.b];
    const Mover was_a{a.geometry, a.radius, a.pose, velocity_between(a.pose, end_a, move.p.dt)};
    const Mover was_b{b.geometry, b.radius, b.pose, velocity_between(b.pose, end_b, move.p.dt)};
    AxisCache axis;
    const float margin = speculative_margin(a.radius, b.radius, was_a.velocity, was_b.velocity, move.p.dt);
    const Manifold seen = collide_shapes(a.geometry, b.geometry, relative(a.pose, b.pose), margin, axis);
    const float skin = skin_of(a, b, half);
    const Apart first = apart_at_first(a, b, near_cores(was_a, was_b, move.p.dt, skin), seen, skin);
    return free_way(a, b, end_a, end_b, first, half, move.p.dt);
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
