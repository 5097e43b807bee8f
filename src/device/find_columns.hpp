// Which constraints make columns (dynamics/columns.hpp).
//
// A column begins with a body that has one contact, its top, and goes on through bodies that have two, to one that
// cannot be pushed or has one contact; it ends before a body with three or more. Columns share no body that can be
// pushed.
#pragma once

#include "device/contact_arrays.hpp"
#include "dynamics/columns.hpp"
#include "exec/atomic.hpp"

namespace fathom::device {

/// Four phases: no neighbours, neighbours, columns, and those that are to be braced. Where the layout of constraints is
/// as it was, so are columns, and the last phase alone is left.
struct FindColumns {
  static constexpr bool ends_at_empty_phase = true;
  static constexpr std::uint32_t group_size = 256;

  BodyArrays bodies;
  ContactArrays contacts;
  ConstraintArrays constraints;
  Counters* counters;

  FATHOM_HD std::uint32_t phases() const {
    if (counters->column_bodies) return 4;
    return counters->live_bodies && counters->columns ? 1 : 0;
  }
  FATHOM_HD std::uint32_t items(std::uint32_t phase) const {
    if (phase + 1 == phases()) return counters->columns;
    return phase == 1 ? counters->constraints : counters->column_bodies;
  }

  FATHOM_HD void operator()(std::uint32_t phase, std::uint32_t i) const {
    if (phase + 1 == phases()) {
      choose(bodies.columns[i]);
    } else if (phase == 0) {
      bodies.neighbours[i] = {};
    } else if (phase == 1) {
      const PairRecord pair = constraints.bodies[i];
      note(pair.b, i);
      if (!is_fixed(i)) note(pair.a, i);
    } else if (bodies.touching[i] == 1 && bodies.neighbours[i].first != none && bodies.constants[i].is_dynamic()) {
      const Walk walk = follow(i, [](std::uint32_t, std::uint32_t) {});
      // Without anything fixed it may have two free ends and be found from both.
      const bool is_mine = walk.stands || walk.end < i || bodies.touching[walk.end] == 2;
      if (is_mine && is_worth_bracing(walk.contacts, walk.uneven)) add(i, walk.contacts);
    }
  }

 private:
  struct Walk {
    std::uint32_t contacts = 0, end = none;
    bool stands = false, uneven = false;
  };

  FATHOM_HD bool is_fixed(std::uint32_t k) const { return contacts.contacts[constraints.contact[k]].fixed_a(); }

  // The least and the greatest of a body's constraints: of two both, in whatever order they come.
  FATHOM_HD void note(std::uint32_t body, std::uint32_t k) const {
    exec::atomic_min(bodies.neighbours[body].first, k);
    exec::atomic_max(bodies.neighbours[body].last, k);
  }

  /// Calls act(constraint, upper body) from the top down.
  template <class Act>
  FATHOM_HD Walk follow(std::uint32_t top, const Act& act) const {
    Walk walk{0, top};
    std::uint32_t k = bodies.neighbours[top].first;
    while (!walk.stands) {
      const PairRecord pair = constraints.bodies[k];
      const std::uint32_t above = walk.end, below = pair.a == above ? pair.b : pair.a;
      const Contact& c = contacts.contacts[constraints.contact[k]];
      if (c.colour() == overflow_colour || (!c.fixed_a() && bodies.touching[below] > 2)) break;
      act(k, above);
      ++walk.contacts;
      walk.uneven |= is_uneven(bodies.constants[below].inverse_mass, bodies.constants[above].inverse_mass);
      walk.stands = c.fixed_a();
      walk.end = below;
      const Neighbours n = bodies.neighbours[below];
      if (walk.stands || n.first == n.last) break;
      k = n.first == k ? n.last : n.first;
    }
    return walk;
  }

  FATHOM_HD void choose(const ColumnRange& column) const {
    const auto linear = [&](std::uint32_t k, bool upper) {
      const ColumnContact c = bodies.column_contacts[column.first + k];
      const PairRecord pair = constraints.bodies[c.constraint];
      return bodies.velocities[static_cast<bool>(c.upward) == upper ? pair.b : pair.a].linear;
    };
    if (is_calm(linear(column.count - 1, true), linear(0, false)))
      bodies.calm_columns[exec::atomic_add(counters->calm_columns, 1u)] = column;
  }

  FATHOM_HD void add(std::uint32_t top, std::uint32_t count) const {
    std::uint32_t place = exec::atomic_add(counters->column_contacts, count);
    bodies.columns[exec::atomic_add(counters->columns, 1u)] = {place, count};
    place += count;
    follow(top, [&](std::uint32_t k, std::uint32_t above) {
      bodies.column_contacts[--place] = {k & 0x7fffffffu, constraints.bodies[k].b == above};
    });
  }
};

}  // namespace fathom::device
