// Islands of bodies that touch, found by union-find, fall asleep together.
//
// Roots are the smallest index of an island whatever the order of unions, as each joins the larger root to the smaller
// (Jaiganesh and Burtscher, "A High-Performance Connected Components Implementation for GPUs", HPDC 2018).
#pragma once

#include "device/build_constraints.hpp"

namespace fathom::device {

FATHOM_HD std::uint32_t root_of(std::uint32_t* parent, std::uint32_t i) {
  std::uint32_t p = exec::atomic_load(parent[i]);
  while (p != i) {
    i = p;
    p = exec::atomic_load(parent[i]);
  }
  return i;
}

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
    std::uint32_t a = root_of(bodies.parent, c.a), b = root_of(bodies.parent, c.b);
    while (a != b) {
      const std::uint32_t low = a < b ? a : b, high = a < b ? b : a;
      if (exec::atomic_cas(bodies.parent[high], high, low) == high) return;
      a = root_of(bodies.parent, low);
      b = root_of(bodies.parent, high);
    }
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
    if (counters->stopped || !bodies.is_awake(i) || !bodies.constants[i].is_dynamic()) return;
    const std::uint32_t root = root_of(bodies.parent, i);
    if (__builtin_bit_cast(float, bodies.island_slow[root]) < time) return;
    bodies.island[i] = root;
    bodies.flags[i] &= ~awake_flag;
    bodies.velocities[i] = Velocity{};
    exec::atomic_store(counters->layout_dirty, 1u);
  }
};

}  // namespace fathom::device
