// Islands of bodies that touch, found by union-find, fall asleep together.
#pragma once

#include "device/build_constraints.hpp"
#include "device/union_find.hpp"

namespace fathom::device {

struct BeginIslands {
  BodyArrays bodies;

  FATHOM_HD void operator()(std::uint32_t i) const {
    if (!bodies.is_awake(i)) return;
    bodies.parent[i] = i;
    bodies.island_slow[i] = 0x7f7fffffu;  // the largest float
  }
};

struct JoinIslands {
  BodyArrays bodies;
  ContactArrays contacts;

  FATHOM_HD void operator()(std::uint32_t index) const {
    const Contact c = contacts.contacts[index];
    if (!c.in_use() || !c.touching()) return;
    if (c.fixed_a()) {
      // A body that something moving pushes stays awake.
      const Velocity& v = bodies.velocities[c.a];
      if (length_squared(v.linear) + length_squared(v.angular) > 0) bodies.slow_time[c.b] = 0;
      return;
    }
    if (!(bodies.flags[c.a] & bodies.flags[c.b] & awake_flag)) return;
    unite(bodies.parent, c.a, c.b);
  }
};

/// The least slow time of an island. Times are not negative, so their bits are in the order of their values.
struct MeasureIslands {
  BodyArrays bodies;
  Counters* counters;

  FATHOM_HD void operator()(std::uint32_t i) const {
    if (!bodies.is_awake(i)) return;
    exec::atomic_add(counters->active, 1u);
    const std::uint32_t root = root_of(bodies.parent, i);
    if (root == i) exec::atomic_add(counters->islands, 1u);
    exec::atomic_min(bodies.island_slow[root], __builtin_bit_cast(std::uint32_t, bodies.slow_time[i]));
  }
};

struct FallAsleep {
  BodyArrays bodies;
  Counters* counters;
  float time;  ///< s

  FATHOM_HD void operator()(std::uint32_t i) const {
    if (!bodies.is_awake(i) || !bodies.constants[i].is_dynamic()) return;
    const std::uint32_t root = root_of(bodies.parent, i);
    if (__builtin_bit_cast(float, bodies.island_slow[root]) < time) return;
    bodies.island[i] = root;
    bodies.flags[i] &= ~awake_flag;
    bodies.velocities[i] = Velocity{};
    exec::atomic_store(counters->layout_dirty, 1u);
  }
};

}  // namespace fathom::device
