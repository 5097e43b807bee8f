// Islands of touching bodies, found by union-find, fall asleep together.
#pragma once

#include "device/build_constraints.hpp"
#include "device/joint_arrays.hpp"
#include "device/union_find.hpp"
#include "dynamics/move_to.hpp"
#include "dynamics/moving_surface.hpp"
#include "dynamics/sleep.hpp"

namespace fathom::device {

/// Meaning of a body's `best` while islands fall asleep, when colouring no longer needs that word.
enum Rest : std::uint64_t {
  is_carried = 1,    ///< a contact or a joint acts on it
  is_supported = 2,  ///< one of them is with something that cannot be pushed; for an island: on some body
  is_moving = 4,     ///< for an island: some of its bodies move
};

struct BeginIslands {
  Bodies<body_colours, body_islands> bodies;

  FATHOM_HD void operator()(std::uint32_t i) const {
    if (!bodies.is_awake(i)) return;
    bodies.parent[i] = i;
    bodies.island_slow[i] = 0x7f7fffffu;  // the largest float
    bodies.best[i] = 0;
  }
};

/// Effect of a contact or a joint on its bodies' islands.
struct IslandLink {
  Bodies<body_state, body_colours, body_islands> bodies;
  float time;  ///< s

  /// `acts`: whether it acts, called only for bodies that have been slow for long enough.
  template <class Acts>
  FATHOM_HD void join(std::uint32_t a, std::uint32_t b, bool fixed_a, const Acts& acts) const {
    const auto note_rest = [&](std::uint32_t i, std::uint64_t rest) {
      if (bodies.slow_time[i] >= time && acts()) exec::atomic_or(bodies.best[i], rest);
    };
    if (fixed_a) {
      // A body stays awake while something moving pushes it.
      const Velocity& v = bodies.velocities[a];
      if (fathom::is_moving(v)) bodies.slow_time[b] = 0;
      note_rest(b, is_carried | is_supported);
      return;
    }
    const bool a_awake = bodies.is_awake(a), b_awake = bodies.is_awake(b);
    // One of them may be in quarantine.
    if (a_awake) note_rest(a, b_awake ? is_carried : is_carried | is_supported);
    if (b_awake) note_rest(b, a_awake ? is_carried : is_carried | is_supported);
    if (a_awake && b_awake) unite(bodies.parent, a, b);
  }
};

struct JoinIslands {
  IslandLink link;
  Contacts<> contacts;

  FATHOM_HD void operator()(std::uint32_t index) const {
    const Contact c = contacts.contacts[index];
    if (!c.in_use() || !c.touching()) return;
    if (c.on_moving_surface()) look_at_surface(index, c);
    link.join(c.a, c.b, c.fixed_a(), [&] { return contacts.manifolds[c.manifold].step_impulse > 0; });
  }

 private:
  /// A body that a moving surface carries stays awake, however slow it is; so does one that drives on it.
  FATHOM_HD void look_at_surface(std::uint32_t index, const Contact& c) const {
    const auto& bodies = link.bodies;
    const Vec3 velocity = bodies.velocities[c.b].linear - bodies.velocities[c.a].linear;
    if (!goes_with_surface(surface_slide(bodies, contacts, index), velocity)) return;
    bodies.slow_time[c.b] = 0;
    if (!c.fixed_a()) bodies.slow_time[c.a] = 0;
  }
};

struct JoinIslandsByJoints {
  IslandLink link;
  Joints<> joints;
  const Counters* counters;

  FATHOM_HD void operator()(std::uint32_t slot) const {
    if (slot >= counters->joints || counters->live_bodies == 0) return;
    const JointRecord& joint = joints.records[slot];
    if (!joint.in_use()) return;
    link.join(joint.a, joint.b, joint.fixed_a, [&] { return joint.is_generic || !(joint.total == Vec3{}); });
  }
};

/// Minimum slow time of an island. Times are not negative, so their bits have the order of their values.
struct MeasureIslands {
  Bodies<body_state, body_colours, body_islands> bodies;
  Counters* counters;
  float time;         ///< s
  float still_speed;  ///< m/s

  FATHOM_HD void operator()(std::uint32_t i) const {
    if (!bodies.is_awake(i)) return;
    exec::atomic_add(counters->active, 1u);
    const std::uint32_t root = root_of(bodies.parent, i);
    if (root == i) exec::atomic_add(counters->islands, 1u);
    float slow_time = bodies.slow_time[i];
    if (slow_time >= time && bodies.constants[i].is_dynamic()) {
      const std::uint64_t rest = exec::atomic_load(bodies.best[i]);
      const bool moves = speed_of(bodies.velocities[i], bodies.constants[i].radius) > still_speed;
      if (moves && !(rest & is_carried)) slow_time = bodies.slow_time[i] = 0;
      const std::uint64_t of_island = (rest & is_supported) | (moves ? std::uint64_t{is_moving} : 0);
      if (of_island) exec::atomic_or(bodies.best[root], of_island);
    }
    exec::atomic_min(bodies.island_slow[root], __builtin_bit_cast(std::uint32_t, slow_time));
  }
};

struct FallAsleep {
  Bodies<body_state, body_islands> bodies;
  Counters* counters;
  float time;  ///< s

  FATHOM_HD void operator()(std::uint32_t i) const {
    if (counters->stopped || !bodies.is_awake(i)) return;
    if (!bodies.constants[i].is_dynamic()) return arrive(i);
    const std::uint32_t root = root_of(bodies.parent, i);
    if (__builtin_bit_cast(float, bodies.island_slow[root]) < time) return;
    if ((bodies.best[root] & (is_supported | is_moving)) == is_moving) return;
    bodies.island[i] = root;
    bodies.flags[i] &= ~awake_flag;
    bodies.velocities[i] = Velocity{};
    exec::atomic_store(counters->layout_dirty, 1u);
  }

 private:
  /// A kinematic body stops once it is at its target.
  FATHOM_HD void arrive(std::uint32_t i) const {
    if (!(bodies.flags[i] & forced_flag)) return;
    bodies.flags[i] &= ~static_cast<std::uint32_t>(forced_flag);
    bodies.velocities[i] = Velocity{};
  }
};

}  // namespace fathom::device
