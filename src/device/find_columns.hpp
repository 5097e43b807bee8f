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

/// Notes constraint k, which is laid out, with the bodies it can push: the least and the greatest of a body's. Of two
/// these are both, in whatever order they come.
FATHOM_HD void note_neighbour(const BodyArrays& bodies, std::uint32_t body, std::uint32_t k) {
  exec::atomic_min(bodies.neighbours[body].first, k);
  exec::atomic_max(bodies.neighbours[body].last, k);
}

/// Where constraints have been laid out anew, item i is a body, which may be a column's top; else columns are as they
/// were, and item i is one of them, if there are so many. Part of LoadBodies.
struct FindColumns {
  BodyArrays bodies;
  ContactArrays contacts;
  ConstraintArrays constraints;
  Counters* counters;

  FATHOM_HD void operator()(std::uint32_t i) const {
    if (!counters->finds_columns) {
      if (i < counters->columns) choose(bodies.columns[i]);
    } else if (bodies.touching[i] == 1 && bodies.neighbours[i].first != none && bodies.constants[i].is_dynamic() &&
               bodies.is_awake(i)) {
      look_down(i);
    }
  }

 private:
  struct Walk {
    std::uint32_t contacts = 0, end = none;
    bool stands = false, uneven = false;
  };

  FATHOM_HD void look_down(std::uint32_t top) const {
    const Walk walk = follow(top, [](std::uint32_t, std::uint32_t) {});
    // Without anything fixed it may have two free ends and be found from both.
    const bool is_mine = walk.stands || walk.end < top || bodies.touching[walk.end] == 2;
    if (is_mine && is_worth_bracing(walk.contacts, walk.uneven)) add(top, walk.contacts);
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

  FATHOM_HD void choose(ColumnRange& column) const {
    const ColumnContact* const base = bodies.column_contacts + column.first;
    const std::uint32_t top = base[column.count - 1].above;
    column.calm = is_calm(bodies.velocities[top].linear, bodies.velocities[base->below].linear);
    if (column.calm) exec::atomic_store(counters->any_calm_column, 1u);
  }

  FATHOM_HD void add(std::uint32_t top, std::uint32_t count) const {
    const std::uint32_t first = exec::atomic_add(counters->column_contacts, count);
    const std::uint32_t column = exec::atomic_add(counters->columns, 1u);
    std::uint32_t place = first + count;
    follow(top, [&](std::uint32_t k, std::uint32_t above) {
      const PairRecord pair = constraints.bodies[k];
      const bool upward = pair.b == above;
      bodies.column_contacts[--place] = {k & 0x7fffffffu, upward, 0, upward ? pair.a : pair.b, above};
    });
    bodies.columns[column] = {first, count & 0x7fffffffu, 0};
    choose(bodies.columns[column]);
  }
};

}  // namespace fathom::device
