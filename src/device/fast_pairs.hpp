// Pairs that move fast for their size (dynamics/look_ahead.hpp). They are few: separate lists keep the search for the
// time of impact out of the kernels that process every contact.
#pragma once

#include "device/finish.hpp"
#include "device/update_manifolds.hpp"
#include "dynamics/free_end.hpp"
#include "dynamics/triangle_ahead.hpp"
#include "dynamics/way_over_seam.hpp"

namespace fathom::device {

/// The geometry is read by a team if it may be a hull.
template <bool with_hulls, BodyPart... written>
FATHOM_HD Mover mover(const Bodies<written...>& bodies, std::uint32_t i, const Pose& pose, const Velocity& velocity) {
  return {with_hulls ? bodies.geometry_for_team(i) : bodies.simple_geometry(i), bodies.constants[i].radius, pose,
          velocity};
}

/// Third pass of the narrow phase; item k is a pair, with a hull or without, that is fast or may touch at a seam. When
/// a step resumes that stopped for lack of manifolds, only new ones and those without a manifold are left to look at.
template <bool with_hulls>
struct LookAheadPairs {
  static constexpr std::uint32_t group_size = 64;
  static constexpr bool runs_in_teams = with_hulls;

  ContactChanges changes;
  float dt;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const auto& bodies = changes.bodies;
    const std::uint32_t pair = changes.contacts.fast_at(with_hulls, k);
    const bool was_looked_at = k < changes.counters->looked_ahead[with_hulls];
    if (was_looked_at && changes.contacts.fast[pair].next != FastPair::lacks_manifold) return;
    const std::uint32_t index = changes.contacts.fast[pair].contact;
    Contact c = changes.contacts.contacts[index];
    const TouchingPieces pieces = pieces_of(bodies, c);
    const Mover a = mover<with_hulls>(bodies, pieces.a, bodies.poses[pieces.a], bodies.velocities[pieces.a]);
    const Mover b = mover<with_hulls>(bodies, pieces.b, bodies.poses[pieces.b], bodies.velocities[pieces.b]);
    const Pose b_in_a = relative(a.pose, b.pose);
    const float margin = speculative_margin(a.radius, b.radius, a.velocity, b.velocity, dt);
    AxisCache axis = c.axis;
    Manifold seen = collide_shapes<with_hulls>(a.geometry, b.geometry, b_in_a, margin, axis);
    const float half = changes.half_of_thinner(pieces);
    const bool pressed = c.fixed_a() && is_pressed(seen, half);
    const LookAhead found = look_ahead<with_hulls>(a, b, seen, margin, half, dt);
    if constexpr (runs_in_teams) {
      team::sync();
      if (!team::is_leader()) return;
    }
    if (found.ahead == Ahead::nothing) seen.count = 0;
    const bool meets = found.ahead == Ahead::meets;
    if (meets) seen = found.manifold;
    const Pose& b_then = meets ? found.b_in_a : b_in_a;
    const auto& contacts = changes.contacts;
    const auto seams = seams_of(bodies, contacts, dt);
    if (seams.may_have(pieces)) seen = seams.kept(pieces, b_then, margin, seen).manifold;
    const bool is_taken = changes.take(index, c, seen, b_then, meets ? found.time : -1);
    contacts.fast[pair].next = is_taken ? none : FastPair::lacks_manifold;
    if (!is_taken) {
      exec::atomic_add(changes.counters->lacking_manifolds, 1u);
      return;
    }
    if (pressed && c.touching()) contacts.manifolds[c.manifold].forget_build();  // the next step must see it
    if (found.is_watched && (c.fixed_a() || is_bullet(c.a) || is_bullet(c.b))) changes.watch(pair, c);
  }

 private:
  FATHOM_HD bool is_bullet(std::uint32_t body) const { return changes.bodies.constants[body].is_bullet(); }
};

/// A body that ended inside or behind a non-dynamic body goes as far as its way was free, and continues in the next
/// step. Then `from_free` lets the lighter of two dynamic bodies end beside the end pose of the heavier one. A body
/// that was held back, or that strayed, may have reached a body with which it forms no fast pair: its whole way is
/// searched for non-dynamic bodies. Item k is a body of `Bodies::fast`.
template <bool with_hulls>
struct HoldBackFast {
  static constexpr std::uint32_t group_size = 64;
  static constexpr bool runs_in_teams = with_hulls;

  MoveBodies move;
  Contacts<contact_manifolds> contacts;
  ApartTable apart;
  bool has_grid;  ///< the grid of the last search exists
  bool from_free;
  bool is_last;  ///< nothing reads the pairs after this

  FATHOM_HD void operator()(std::uint32_t k) const {
    const auto& bodies = move.bodies;
    if (move.counters->stopped) return;
    const std::uint32_t i = bodies.fast[k];
    const bool moved = can_be_held(i) && hold_back(i);
    sync();
    if (!leads()) return;
    if (moved) put_box(i);
    if (is_last)
      bodies.fast_pair[i] = none;
    else
      bodies.ends[i] = bodies.poses[i];
  }

 private:
  FATHOM_HD static void sync() {
    if constexpr (runs_in_teams) team::sync();
  }
  FATHOM_HD static bool leads() { return !runs_in_teams || team::is_leader(); }

  FATHOM_HD bool can_be_held(std::uint32_t i) const {
    return (move.bodies.flags[i] & (awake_flag | isolated_flag)) == awake_flag;
  }

  /// Obstacles that hold a body back, round by round. Held back by one, it may end in another, so its way is searched
  /// several times.
  enum Round : int {
    free_pairs,
    fixed_pairs,
    first_search,
    last_search = first_search + hold_back_rounds - 1,
    beside_carrier
  };

  /// Returns whether it changed the body's end pose.
  FATHOM_HD bool hold_back(std::uint32_t i) const {
    const auto& bodies = move.bodies;
    bool moved = false, is_free = true;  // moved in any round; free in this one
    const bool has_joints = bodies.joint_colours[i] != 0;
    int round = from_free ? free_pairs : fixed_pairs;
    std::uint32_t carrier = none;
    Aabb way;
    // In the order of indices: chains and grid cells have no fixed order.
    for (std::uint64_t last = no_obstacle;;) {
      const Obstacle o = round < first_search ? next_of_pairs(i, last, round == free_pairs)
                                              : next_on_way(i, last, way, round == beside_carrier);
      if (o.key == no_obstacle) {
        if (!moved && (from_free || bodies.before[i].reserved == 0)) return false;
        if (round >= first_search && (is_free || round == beside_carrier)) return moved;
        if (round == last_search) {
          put(i, begin_beside(i, carrier), bodies.velocities[i]);
          if (carrier == none) return true;
        }
        round = round >= first_search ? first_search + round_after(round - first_search, has_joints) : round + 1;
        if (round == first_search + turned_back_from || round == first_search + moved_back_from) {
          Pose pose = bodies.before[i];
          Velocity v = bodies.velocities[i];
          if (round == first_search + turned_back_from)
            pose.position = bodies.poses[i].position;
          else
            v.linear *= kept_when_stuck, v.angular *= kept_when_stuck;
          put(i, pose, v);
        }
        way = box_of_way(i);
        last = no_obstacle, is_free = true;
        continue;
      }
      last = o.key;
      Pose end;
      Velocity then;
      const bool is_searching = round >= first_search && round <= last_search;
      const HoldBack how = is_searching ? how_in(round - first_search, has_joints) : HoldBack::with_room;
      if (!is_held(o, i, how, end, then)) continue;
      moved = true, is_free = false;
      if (bodies.constants[o.piece()].motion() == MotionType::kinematic) carrier = body_of(bodies, o.piece());
      if (o.contact != none) forget_build(o.contact);
      put(i, end, then);
    }
  }

  static constexpr std::uint64_t no_obstacle = ~std::uint64_t{0};

  /// A piece of a body that may hold back a piece of another.
  struct Obstacle {
    std::uint64_t key = no_obstacle;  ///< the two pieces
    std::uint32_t contact = none;     ///< of the fast pair, if there is one
    bool is_free = false;             ///< it is dynamic

    FATHOM_HD std::uint32_t piece() const { return static_cast<std::uint32_t>(key >> 32); }
    FATHOM_HD std::uint32_t held_piece() const { return static_cast<std::uint32_t>(key); }
  };

  FATHOM_HD void put(std::uint32_t i, const Pose& end, Velocity v) const {
    const auto& bodies = move.bodies;
    const Pose was = bodies.poses[i];
    if (!bodies.constants[i].is_isotropic()) v.angular = spin_put_back(v.angular, was.rotation, end.rotation);
    sync();
    if (leads()) {
      bodies.velocities[i] = v;
      // A body that is put back in many steps would accumulate the rounding of all their products.
      bodies.poses[i] = {end.position, was.reserved, normalize(end.rotation)};
    }
    sync();
  }

  FATHOM_HD void forget_build(std::uint32_t contact) const {
    const Contact& c = contacts.contacts[contact];
    if (!leads()) return;
    if (c.touching()) contacts.manifolds[c.manifold].forget_build();
    if (!c.is_with_surface()) return;
    for (std::uint32_t k = c.manifold; k != none; k = contacts.contacts[k].next_patch()) {
      const Contact& patch = contacts.contacts[k];
      if (patch.touching()) contacts.manifolds[patch.manifold].forget_build();
    }
  }

  /// The pose where the body began, outside of all obstacles, carried along by `carrier` if there is one.
  FATHOM_HD Pose begin_beside(std::uint32_t i, std::uint32_t carrier) const {
    const Pose& begin = move.bodies.before[i];
    return carrier == none ? begin : move.bodies.poses[carrier] * relative(begin_of(carrier), begin);
  }

  /// Pose of a non-dynamic body as the step began.
  FATHOM_HD Pose begin_of(std::uint32_t i) const {
    const Pose& end = move.bodies.poses[i];
    if (move.bodies.constants[i].motion() == MotionType::fixed) return end;
    if (is_arrived(i)) return move.bodies.before[i];
    return advanced(end, move.bodies.velocities[i], -move.p.dt);
  }
  /// Whether a non-dynamic body was taken to a target in this step and has stopped there. Where bodies sleep they stop
  /// later (device/sleep.hpp).
  FATHOM_HD bool is_arrived(std::uint32_t i) const {
    const auto& bodies = move.bodies;
    return !move.p.sleeping && bodies.constants[i].motion() == MotionType::kinematic && bodies.is_awake(i) &&
           bodies.before[i].reserved == has_arrived;
  }
  /// Velocity of a non-dynamic body within the step.
  FATHOM_HD Velocity velocity_in_step(std::uint32_t i) const {
    const auto& bodies = move.bodies;
    return is_arrived(i) ? velocity_between(bodies.before[i], bodies.poses[i], move.p.dt) : bodies.velocities[i];
  }

  FATHOM_HD Aabb box_of_way(std::uint32_t i) const {
    return box_of_way(i, move.bodies.before[i], move.bodies.poses[i]);
  }
  FATHOM_HD Aabb box_of_way(std::uint32_t piece, const Pose& begin, const Pose& end) const {
    const Aabb centres{min(begin.position, end.position), max(begin.position, end.position)};
    return grown(centres, move.bodies.constants[piece].radius);
  }

  /// Pose of a piece of a body with the pose `body`.
  FATHOM_HD Pose pose_of(std::uint32_t piece, const Pose& body) const {
    return move.bodies.constants[piece].is_child() ? body * move.bodies.child_poses[piece] : body;
  }
  FATHOM_HD Pose end_of_piece(std::uint32_t piece) const {
    return pose_of(piece, move.bodies.poses[body_of(move.bodies, piece)]);
  }
  /// Velocity of a piece of a body with the pose `body` and the velocity `v`.
  FATHOM_HD Velocity velocity_of(std::uint32_t piece, const Pose& body, const Velocity& v) const {
    if (!move.bodies.constants[piece].is_child()) return v;
    return velocity_of_child(move.bodies.child_poses[piece], body, v, advanced(body, v, move.p.dt), move.p.dt);
  }

  /// Which of two dynamic bodies the other holds back.
  FATHOM_HD std::uint32_t held_of(const Contact& c) const {
    const bool is_a_lighter = move.bodies.constants[c.a].inverse_mass > move.bodies.constants[c.b].inverse_mass;
    return !can_be_held(c.b) || (can_be_held(c.a) && is_a_lighter) ? c.a : c.b;
  }

  /// The first obstacle after `last` (`no_obstacle`: of all) that holds body i back in a fast pair.
  FATHOM_HD Obstacle next_of_pairs(std::uint32_t i, std::uint64_t last, bool is_free) const {
    Obstacle next;
    for (std::uint32_t pair = move.bodies.fast_pair[i]; pair != none;) {
      const FastPair& f = contacts.fast[pair];
      const Contact& c = contacts.contacts[f.contact];
      const bool is_asked = c.fixed_a() ? !is_free : is_free && held_of(c) == i;
      const TouchingPieces pieces = pieces_of(move.bodies, c);
      const std::uint64_t key = c.b == i ? key_of(pieces.a, pieces.b) : key_of(pieces.b, pieces.a);
      if (is_asked && !is_refused(c) && is_after(last, key) && key < next.key) next.key = key, next.contact = f.contact;
      pair = c.b == i ? f.next : contacts.next_of_a[pair];
    }
    next.is_free = is_free;
    return next;
  }

  /// Whether the application has refused the contact in this step, or all of a surface's.
  FATHOM_HD bool is_refused(const Contact& c) const {
    if (!c.is_with_surface()) return c.refused();
    bool any_refused = false;
    for (std::uint32_t k = c.manifold; k != none; k = contacts.contacts[k].next_patch()) {
      if (contacts.contacts[k].touching()) return false;
      any_refused |= contacts.contacts[k].refused();
    }
    return any_refused;
  }

  /// Whether the application has refused all contacts of two bodies in this step, or the pair.
  FATHOM_HD bool is_refused(std::uint32_t a, std::uint32_t b) const {
    const std::uint64_t key = refused_key(a, b);
    std::uint32_t first = 0, end = move.counters->refused;
    while (first < end) {
      const std::uint32_t middle = (first + end) / 2;
      if (contacts.refused[middle] < key)
        first = middle + 1;
      else
        end = middle;
    }
    return first < move.counters->refused && contacts.refused[first] == key;
  }

  FATHOM_HD static std::uint64_t key_of(std::uint32_t obstacle, std::uint32_t held) {
    return std::uint64_t{obstacle} << 32 | held;
  }
  FATHOM_HD static bool is_after(std::uint64_t last, std::uint64_t key) { return last == no_obstacle || key > last; }

  /// The first non-dynamic obstacle after `last` (`no_obstacle`: of all) that was in the box, in world axes.
  FATHOM_HD Obstacle next_on_way(std::uint32_t i, std::uint64_t last, const Aabb& way, bool only_fixed) const {
    const auto& bodies = move.bodies;
    Obstacle next;
    const BodyConstants& c = bodies.constants[i];
    const bool is_compound = c.is_compound();
    const auto ask = [&](std::uint32_t other) {
      const MotionType motion = bodies.constants[other].motion();
      if (motion == MotionType::dynamic || (only_fixed && motion != MotionType::fixed)) return;
      if (is_asked_about(bodies, i, other) && is_refused(i, body_of(bodies, other))) return;
      const Aabb box = bodies.known[other].box();
      if (!overlaps(box, way) || (apart.is_on && apart.has(i, body_of(bodies, other)))) return;
      for (std::uint32_t k = 0; k < (is_compound ? c.hull : 1); ++k) {
        const std::uint32_t held = is_compound ? c.link + k : i;
        const std::uint64_t key = key_of(other, held);
        if (!is_after(last, key) || key >= next.key || !may_pieces_collide(bodies, held, other)) continue;
        if (!is_compound || overlaps(box, box_of_way(held, pose_of(held, bodies.before[i]), end_of_piece(held))))
          next.key = key;
      }
    };
    if (has_grid)
      for_each_in_grid(way, ask);
    else
      for (std::uint32_t j = 0; j < move.counters->bodies; ++j) ask(j);
    return next;
  }

  /// Calls act(body) for every body that was in the box, in world axes, and for others; for some more than once.
  template <class Act>
  FATHOM_HD void for_each_in_grid(const Aabb& box, const Act& act) const {
    const GridView& grid = move.grid;
    const std::uint32_t bodies = move.counters->bodies;
    for (std::uint32_t k = 0; k < move.counters->big; ++k) act(grid.big[k]);
    const float rounding = 4 * Grid::rounding(box);
    for (std::uint32_t level = 0; level < grid_levels; ++level) {
      if (!(move.counters->levels >> level & 1u)) continue;
      // Contains the centres of all boxes of this level that overlap this one.
      const Aabb middles = grown(box, 0.5f * grid.edge(level) + rounding);
      const Cell first = grid.cell_of(middles.lower, level), end = grid.cell_of(middles.upper, level);
      const auto width = [](std::int32_t from, std::int32_t to) { return static_cast<float>(to - from) + 1; };
      if (width(first.x, end.x) * width(first.y, end.y) * width(first.z, end.z) > static_cast<float>(bodies)) {
        for (std::uint32_t j = 0; j < bodies; ++j) act(j);
        return;
      }
      Cell cell;
      for (cell.z = first.z; cell.z <= end.z; ++cell.z)
        for (cell.y = first.y; cell.y <= end.y; ++cell.y)
          for (cell.x = first.x; cell.x <= end.x; ++cell.x)
            for (std::uint32_t j = grid.heads[grid.entry(cell, level)]; j != none; j = grid.next[j]) act(j);
    }
  }

  /// Whether the obstacle holds body i back, and its end pose and velocity then.
  FATHOM_HD bool is_held(const Obstacle& o, std::uint32_t i, HoldBack how, Pose& end, Velocity& then) const {
    const auto& bodies = move.bodies;
    const TouchingPieces pieces{o.piece(), o.held_piece()};
    const auto [a, b] = pieces;
    const std::uint32_t body_a = body_of(bodies, a);
    const float dt = move.p.dt;
    const bool is_noted = o.contact != none;
    const Pose begin_of_a = is_noted ? bodies.before[body_a] : begin_of(body_a), begin_of_b = bodies.before[i];
    const Pose end_of_b = bodies.poses[i];
    const Pose end_a = pose_of(a, o.is_free ? bodies.ends[body_a] : bodies.poses[body_a]), end_b = pose_of(b, end_of_b);
    const Pose pose_a = pose_of(a, begin_of_a), pose_b = pose_of(b, begin_of_b);
    if (bodies.constants[a].is_surface())
      return is_held_by_surface({a, pose_a, end_a}, {b, pose_b, end_b}, i, end, then);
    const Mover was_a = mover<with_hulls>(bodies, a, pose_a, velocity_between(pose_a, end_a, dt));
    const Mover was_b = mover<with_hulls>(bodies, b, pose_b, velocity_between(pose_b, end_b, dt));
    // Another item may be writing the velocity of a dynamic body.
    const Velocity velocity_a = o.is_free ? was_a.velocity : velocity_of(a, begin_of_a, velocity_in_step(body_a));
    const Mover on_a{was_a.geometry, was_a.radius, pose_a, velocity_a};
    const Mover on_b{was_b.geometry, was_b.radius, pose_b, velocity_of(b, begin_of_b, bodies.velocities[i])};
    const float half = min(half_thickness(bodies.constants[a]), half_thickness(bodies.constants[b]));
    AxisCache axis;
    const float margin = speculative_margin(on_a.radius, on_b.radius, was_a.velocity, was_b.velocity, dt);
    const Manifold seen =
        collide_shapes<with_hulls>(on_a.geometry, on_b.geometry, relative(pose_a, pose_b), margin, axis);
    const float skin = skin_of(on_a, on_b, half);
    const Apart first = apart_at_first(on_a, on_b, near_cores(was_a, was_b, dt, skin), seen, skin);
    FreeWay way = free_way<with_hulls>(on_a, on_b, end_a, end_b, first, half, dt, how);
    const auto seams = seams_of(bodies, contacts, dt);
    if (!way.is_free && !o.is_free && seams.may_have(pieces)) {
      const auto kept = [&](const Pose& b_in_a, float close, const Manifold& m) {
        return seams.kept(pieces, b_in_a, close, m);
      };
      find_way_over_seam<with_hulls>(on_a, on_b, end_a, end_b, first, half, dt, kept, way);
    }
    if (way.is_free) return false;
    then = bodies.velocities[i];
    if (o.is_free) {
      end = end_beside(way, on_a, on_b, end_a, end_b, first, half, dt);
      if (bodies.constants[b].is_child()) end = end * relative(bodies.child_poses[b], {});
      return true;
    }
    end = end_of(way, begin_of_b, end_of_b, dt);
    if (way.is_lifted) {
      const BodyConstants& c = bodies.constants[i];
      then = stopped(way, on_a.velocity, end_a.position, end_b.position, then, end_of_b, c.inverse_mass,
                     c.inverse_inertia, bodies.tensors[i].inverse);
      then.angular = limited(then.angular, move.p.limits.angular);
    }
    then.linear = limited(then.linear, move.p.limits.linear);
    return true;
  }

  /// A piece as the step begins and ends.
  struct Moved {
    std::uint32_t piece;
    Pose begin, end;
  };
  /// Never lets the centre of a body's piece get behind a triangle, which would push it out on the other side. From
  /// half the piece's thickness in front, or from its initial distance, the centre slides along the triangle
  /// (`slowed_by_triangles` gives its velocity).
  FATHOM_HD bool is_held_by_surface(const Moved& a, const Moved& b, std::uint32_t i, Pose& end, Velocity& then) const {
    const auto& bodies = move.bodies;
    const float half = half_thickness(bodies.constants[b.piece]);
    const Vec3 moved = inverse_transform(a.end, b.end.position) - inverse_transform(a.begin, b.begin.position);
    if (length_squared(moved) <= surface_creep * surface_creep * half * half) return false;
    const SurfaceView& surface = bodies.surfaces[bodies.constants[a.piece].hull];
    const auto for_each_in = [&](const Aabb& box, const auto& act) {
      surface.for_each_in(box, [&](std::uint32_t number) { act(surface.triangle(number)); });
    };
    const CentreWay way = centre_way(for_each_in, a.begin, a.end, b.begin.position, b.end.position, half);
    if (way.stops == 0) return false;
    const Vec3 back = way.end - b.end.position;
    if (length_squared(back) <= already_there * already_there * half * half) return false;
    end = bodies.poses[i];
    end.position += back;
    then = bodies.velocities[i];
    then.linear = slowed_by_triangles(way, end.position, velocity_in_step(a.piece), a.end.position, then);
    return true;
  }

  /// Updates the body's boxes to its new pose.
  FATHOM_HD void put_box(std::uint32_t i) const {
    const auto& bodies = move.bodies;
    if (bodies.constants[i].is_compound()) return;  // its children are placed before the next search
    const Pose& pose = bodies.poses[i];
    const Velocity& v = bodies.velocities[i];
    const float radius = bodies.constants[i].radius;
    const Aabb box = motion_box(bodies.bounds(i, pose), radius, v, move.p.dt);
    bodies.boxes[i] = box;
    if (!contains(bodies.fat[i].box(), box)) move.put_fat_box(i, fat_box(radius, box, v.linear, move.p.dt), box_change);
  }
};

}  // namespace fathom::device
