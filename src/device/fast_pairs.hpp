// Pairs that move fast for their size (dynamics/look_ahead.hpp): few, so lists of their own keep the search for the
// time of impact out of the kernels that every contact goes through.
#pragma once

#include "device/finish.hpp"
#include "device/update_manifolds.hpp"
#include "dynamics/free_end.hpp"
#include "dynamics/way_over_seam.hpp"

namespace fathom::device {

/// For a team, if it may be a hull.
template <bool with_hulls, BodyPart... written>
FATHOM_HD Mover mover(const Bodies<written...>& bodies, std::uint32_t i, const Pose& pose, const Velocity& velocity) {
  return {with_hulls ? bodies.geometry_for_team(i) : bodies.simple_geometry(i), bodies.constants[i].radius, pose,
          velocity};
}

/// Third pass of the narrow phase; item k is a fast pair or one that may touch at a seam, with a hull, or one without.
template <bool with_hulls>
struct LookAheadPairs {
  static constexpr std::uint32_t group_size = 64;
  static constexpr bool runs_in_teams = with_hulls;

  ContactChanges changes;
  float dt;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const auto& bodies = changes.bodies;
    if (k < changes.counters->looked_ahead[with_hulls]) return;
    const std::uint32_t pair = changes.contacts.fast_at(with_hulls, k);
    const std::uint32_t index = changes.contacts.fast[pair].contact;
    Contact c = changes.contacts.contacts[index];
    const Mover a = mover<with_hulls>(bodies, c.a, bodies.poses[c.a], bodies.velocities[c.a]);
    const Mover b = mover<with_hulls>(bodies, c.b, bodies.poses[c.b], bodies.velocities[c.b]);
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
    const bool meets = found.ahead == Ahead::meets;
    if (meets) seen = found.manifold;
    const Pose& b_then = meets ? found.b_in_a : b_in_a;
    const auto& contacts = changes.contacts;
    const auto seams = seams_of(bodies, contacts);
    if (seams.may_have(c.a)) seen = seams.kept(c.a, c.b, b_then, margin, seen).manifold;
    if (!changes.take(index, c, seen, b_then, meets ? found.time : -1)) {
      changes.defer(index, shape_pair(a.geometry.type, b.geometry.type));
    } else if (found.is_fast && (c.fixed_a() || is_bullet(c.a) || is_bullet(c.b))) {
      bodies.before[c.a] = a.pose;
      bodies.before[c.b] = b.pose;
      contacts.fast[pair].next = chained(pair, c.b);
      if (!c.fixed_a()) contacts.next_of_a[pair] = chained(pair, c.a);
    }
  }

 private:
  FATHOM_HD bool is_bullet(std::uint32_t body) const { return changes.bodies.constants[body].is_bullet(); }

  /// The pair comes first of the body's, in any order: what comes of them does not depend on it. Returns which one did.
  FATHOM_HD std::uint32_t chained(std::uint32_t pair, std::uint32_t body) const {
    return exec::atomic_exchange(changes.bodies.fast_pair[body], pair);
  }
};

/// Where a body with joints has strayed, all that cannot be pushed beside it is asked for on its whole way. Item k is a
/// contact. One that is fast has been listed before, and does no harm.
struct ListStrays {
  ContactChanges changes;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const auto& bodies = changes.bodies;
    const auto& contacts = changes.contacts;
    if (changes.counters->stopped) return;
    const Contact c = contacts.contacts[k];
    if (!c.in_use() || c.apart() || !c.fixed_a()) return;
    if (!bodies.is_awake(c.b) || bodies.joint_colours[c.b] == 0 || bodies.before[c.b].reserved == 0) return;
    if (!bodies.is_awake(c.a)) bodies.before[c.a] = bodies.poses[c.a];
    const auto is_hull = [&](std::uint32_t i) { return bodies.constants[i].shape() == ShapeType::hull; };
    const bool has_hull = is_hull(c.a) || is_hull(c.b);
    const std::uint32_t pair = contacts.fast_at(has_hull, exec::atomic_add(changes.counters->fast[has_hull], 1u));
    contacts.fast[pair] = {k, exec::atomic_exchange(bodies.fast_pair[c.b], pair)};
  }
};

/// What came out inside or behind something that cannot be pushed goes as far as its way was free, and on in the next
/// step. Then, `from_free`, the lighter of two bodies that can both be pushed ends beside the heavier one, from where
/// that has got to by then, and may have to be held back from the former again. Item k is a fast pair of either list;
/// one of each body's pairs speaks for all, if some is with a hull, the first of those.
template <bool with_hulls>
struct HoldBackFast {
  static constexpr std::uint32_t group_size = 64;
  static constexpr bool runs_in_teams = with_hulls;

  MoveBodies move;
  Contacts<contact_manifolds> contacts;
  bool from_free;
  bool is_last;  ///< nobody asks for the pairs after this

  FATHOM_HD void operator()(std::uint32_t k) const {
    if (move.counters->stopped) return;
    const std::uint32_t own = contacts.fast_at(with_hulls, k);
    const Contact& c = contacts.contacts[contacts.fast[own].contact];
    const std::uint32_t sides[] = {c.b, c.a};
    for (const std::uint32_t i : sides) {
      if (i == c.a && c.fixed_a()) continue;
      if (speaker(i) != own) continue;
      const bool moved = can_be_held(i) && hold_back(i);
      sync();
      if (!leads()) continue;
      if (moved) put_box(i);
      if (is_last)
        move.bodies.fast_pair[i] = none;
      else
        move.bodies.ends[i] = move.bodies.poses[i];
    }
  }

 private:
  FATHOM_HD static void sync() {
    if constexpr (runs_in_teams) team::sync();
  }
  FATHOM_HD static bool leads() { return !runs_in_teams || team::is_leader(); }

  FATHOM_HD bool can_be_held(std::uint32_t i) const {
    return (move.bodies.flags[i] & (awake_flag | isolated_flag)) == awake_flag;
  }

  /// Returns whether it has changed where the body gets to.
  FATHOM_HD bool hold_back(std::uint32_t i) const {
    const auto& bodies = move.bodies;
    bool moved = false, is_other_free = from_free;
    // In the order of what they meet: that of the chains is any.
    for (std::uint32_t last = none;;) {
      const std::uint32_t pair = next_after(last, i, is_other_free);
      if (pair == none) {
        if (!is_other_free || !moved) return moved;
        is_other_free = false;
        last = none;
        continue;
      }
      const Contact& c = contacts.contacts[contacts.fast[pair].contact];
      last = c.a == i ? c.b : c.a;
      Pose end;
      Velocity then;
      if (is_held(last, i, is_other_free, end, then)) {
        moved = true;
        sync();
        if (leads()) {
          if (c.touching()) contacts.manifolds[c.manifold].forget_build();
          if (!bodies.constants[i].is_isotropic())
            then.angular = spin_put_back(then.angular, bodies.poses[i].rotation, end.rotation);
          bodies.velocities[i] = then;
          bodies.poses[i] = end;
        }
        sync();
      }
    }
  }

  /// Which of two bodies that can be pushed is held back from the other.
  FATHOM_HD std::uint32_t held_of(const Contact& c) const {
    const bool is_a_lighter = move.bodies.constants[c.a].inverse_mass > move.bodies.constants[c.b].inverse_mass;
    return !can_be_held(c.b) || (can_be_held(c.a) && is_a_lighter) ? c.a : c.b;
  }

  /// Of the body's pairs behind `pair` the next one, or `none`.
  FATHOM_HD std::uint32_t next_of(std::uint32_t pair, std::uint32_t i) const {
    const FastPair& f = contacts.fast[pair];
    return contacts.contacts[f.contact].b == i ? f.next : contacts.next_of_a[pair];
  }

  /// Of the body's pairs the first with a hull, or else the first; `none` where it has none.
  FATHOM_HD std::uint32_t speaker(std::uint32_t i) const {
    const std::uint32_t first = move.bodies.fast_pair[i];
    const std::uint32_t first_with_hull = contacts.fast_capacity - move.counters->fast[true];
    for (std::uint32_t pair = first; pair != none; pair = next_of(pair, i))
      if (pair >= first_with_hull) return pair;
    return first;
  }

  /// The pair in which the body i is held back from the lowest other above `last` (`none`: any), one that can be pushed
  /// or not.
  FATHOM_HD std::uint32_t next_after(std::uint32_t last, std::uint32_t i, bool is_other_free) const {
    std::uint32_t best = none, lowest = none;
    for (std::uint32_t pair = move.bodies.fast_pair[i]; pair != none; pair = next_of(pair, i)) {
      const Contact& c = contacts.contacts[contacts.fast[pair].contact];
      const bool is_asked = c.fixed_a() ? !is_other_free : is_other_free && held_of(c) == i;
      const std::uint32_t other = c.b == i ? c.a : c.b;
      if (is_asked && (last == none || other > last) && other < lowest) best = pair, lowest = other;
    }
    return best;
  }

  /// Whether the body b is held back from a, and where and how fast it ends then.
  FATHOM_HD bool is_held(std::uint32_t a, std::uint32_t b, bool is_a_free, Pose& end, Velocity& then) const {
    const auto& bodies = move.bodies;
    const float dt = move.p.dt;
    const Pose end_a = is_a_free ? bodies.ends[a] : bodies.poses[a], end_b = bodies.poses[b];
    const Pose &pose_a = bodies.before[a], &pose_b = bodies.before[b];
    const Mover was_a = mover<with_hulls>(bodies, a, pose_a, velocity_between(pose_a, end_a, dt));
    const Mover was_b = mover<with_hulls>(bodies, b, pose_b, velocity_between(pose_b, end_b, dt));
    // The velocity of what can be pushed another item may be writing.
    const Mover on_a{was_a.geometry, was_a.radius, pose_a, is_a_free ? was_a.velocity : bodies.velocities[a]};
    const Mover on_b{was_b.geometry, was_b.radius, pose_b, bodies.velocities[b]};
    const float half = min(half_thickness(bodies.constants[a]), half_thickness(bodies.constants[b]));
    AxisCache axis;
    const float margin = speculative_margin(on_a.radius, on_b.radius, was_a.velocity, was_b.velocity, dt);
    const Manifold seen =
        collide_shapes<with_hulls>(on_a.geometry, on_b.geometry, relative(pose_a, pose_b), margin, axis);
    const float skin = skin_of(on_a, on_b, half);
    const Apart first = apart_at_first(on_a, on_b, near_cores(was_a, was_b, dt, skin), seen, skin);
    FreeWay way = free_way<with_hulls>(on_a, on_b, end_a, end_b, first, half, dt);
    const auto seams = seams_of(bodies, contacts);
    if (!way.is_free && !is_a_free && seams.may_have(a)) {
      const auto kept = [&](const Pose& b_in_a, float close, const Manifold& m) {
        return seams.kept(a, b, b_in_a, close, m);
      };
      find_way_over_seam<with_hulls>(on_a, on_b, end_a, end_b, first, half, dt, kept, way);
    }
    if (way.is_free) return false;
    then = bodies.velocities[b];
    if (is_a_free) {
      end = end_beside(way, on_a, on_b, end_a, end_b, first, half, dt);
      return true;
    }
    end = end_of(way, pose_b, end_b, dt);
    if (way.is_lifted) {
      const BodyConstants& c = bodies.constants[b];
      then = stopped(way, on_a.velocity, end_a.position, end_b.position, then, end_b, c.inverse_mass, c.inverse_inertia,
                     bodies.tensors[b].inverse);
    }
    then.linear = limited(then.linear, move.p.limits.linear);
    return true;
  }

  /// What the body's new pose leaves its boxes.
  FATHOM_HD void put_box(std::uint32_t i) const {
    const auto& bodies = move.bodies;
    const Pose& pose = bodies.poses[i];
    const Velocity& v = bodies.velocities[i];
    const float radius = bodies.constants[i].radius;
    const Aabb box = motion_box(bodies.geometry(i), radius, pose, v, move.p.dt);
    bodies.boxes[i] = box;
    if (!contains(bodies.fat[i].box(), box)) move.put_fat_box(i, fat_box(radius, box, v.linear, move.p.dt), box_change);
  }
};

}  // namespace fathom::device
