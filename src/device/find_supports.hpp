// The graph of supports (dynamics/support.hpp): which bodies belong to structures, how far each is from the ground, and
// the factors of their supports' rows.
//
// Only where some contact was overloaded in the step before; else the kernel has no phases. Nothing depends on the
// order in which items run: lists are in any order, sums are of integers, and each body goes through its contacts in
// the order of their colours.
#pragma once

#include "device/support_rows.hpp"
#include "device/union_find.hpp"
#include "exec/kernel.hpp"

namespace fathom::device {

/// Bodies forget, contacts join them, structures are noted, their bodies listed; then one phase for each level, from
/// the ground up.
struct FindSupports {
  static constexpr bool ends_at_empty_phase = true;
  static constexpr std::uint32_t group_size = 128;
  static constexpr std::uint32_t first_level_phase = 4;
  static constexpr std::uint32_t most_phases = first_level_phase + most_levels;
  /// Levels are found anew once in so many steps at least.
  static constexpr std::uint32_t lasting = 16;

  BodyArrays bodies;
  ContactArrays contacts;
  ConstraintArrays constraints;
  Counters* counters;
  float h;  ///< s, a substep

  FATHOM_HD std::uint32_t phases() const {
    const bool is_due = counters->overloaded_step == counters->step && counters->constraints > 0;
    return is_due ? most_phases : 0;
  }
  FATHOM_HD std::uint32_t items(std::uint32_t phase) const {
    const std::uint32_t n = counters->live_bodies, m = counters->constraints;
    if (phase >= first_level_phase) return counters->level[phase - first_level_phase + 1].count;
    if (phase == 3) return n;
    const std::uint32_t both = phase > 0 && n < m ? m : n;
    return both < level_slots ? level_slots : both;
  }
  FATHOM_HD void operator()(std::uint32_t phase, std::uint32_t i) const {
    if (phase >= first_level_phase) return rise(phase - first_level_phase + 1, i);
    const bool is_body = i < counters->live_bodies, is_constraint = i < counters->constraints;
    if (phase == 0) {
      if (i < level_slots) counters->level[i] = {0, 0}, counters->level_cursor[i] = 0;
      if (is_body) forget(i);
    } else if (phase == 1) {
      if (is_constraint) join(i);
      if (is_body && !is_anew()) count(i);
    } else if (phase == 2) {
      if (i < level_slots && !is_anew()) place_level(i);
      if (is_constraint) note_base(i);
      if (is_body) note(i);
    } else {
      list(i);
    }
  }

 private:
  static constexpr float unit = 1u << 30;

  /// Whether levels are found anew. Else bodies keep theirs, so that what stands is held in the same way.
  FATHOM_HD bool is_anew() const {
    const Counters& c = *counters;
    return c.any_began || c.any_ended || c.step % lasting == 0 || c.unlevelled_step == c.step || c.held_step != c.step;
  }

  FATHOM_HD void forget(std::uint32_t i) const {
    const bool pushable = is_pushable(bodies, i);
    BodySupport& s = bodies.support[i];
    if (s.held == was_placed)
      s.held = 1;
    else if (counters->held_step != counters->step || s.level == 0)
      s.held = 0;
    // What sleeps keeps its level: it wakes as part of the structure that it was.
    if (pushable ? is_anew() : !bodies.constants[i].is_dynamic()) s.level = 0;
    bodies.parent[i] = i;
    bodies.structures[i] = Structure{};
    SupportNode& node = bodies.nodes[i];
    node.supports = 0;
    node.held = 0;
    node.contacts = pushable ? bit_count(bodies.colours[i]) + bit_count(bodies.further[i]) : 0;
    if (node.contacts == 0) return;
    node.first = exec::atomic_add(counters->contacts_listed, node.contacts);
    for (std::uint32_t k = 0; k < node.contacts; ++k) constraints.contacts_of[node.first + k] = none;
  }

  FATHOM_HD bool touches(std::uint32_t k) const {
    return touching_points(constraints, k, load_impulses(constraints, k)) != 0;
  }

  FATHOM_HD void join(std::uint32_t k) const {
    constraints.supports[k].upper = no_upper;
    if (is_joint(constraints.heads[k].bits)) return;  // joints support nothing
    const Contact& c = contacts.contacts[constraints.contact[k]];
    if (c.colour() == overflow_colour) return;
    const bool pushes_a = is_pushable(bodies, c.a), pushes_b = is_pushable(bodies, c.b);
    if (pushes_a) join(k, c.colour(), c.a);
    if (pushes_b) join(k, c.colour(), c.b);
    if (pushes_a && pushes_b && touches(k)) unite(bodies.parent, c.a, c.b);
  }
  FATHOM_HD void join(std::uint32_t k, std::uint32_t colour, std::uint32_t i) const {
    const std::uint64_t before = (std::uint64_t{1} << colour % further_colour) - 1;
    const bool is_further = colour >= further_colour;
    const std::uint32_t rank = is_further ? bit_count(bodies.colours[i]) + bit_count(bodies.further[i] & before)
                                          : bit_count(bodies.colours[i] & before);
    const SupportNode& node = bodies.nodes[i];
    if (rank < node.contacts) constraints.contacts_of[node.first + rank] = k;
  }

  FATHOM_HD void count(std::uint32_t i) const {
    if (bodies.support[i].level > 0 && is_pushable(bodies, i))
      exec::atomic_add(counters->level[bodies.support[i].level].count, 1u);
  }
  FATHOM_HD void place_level(std::uint32_t level) const {
    std::uint32_t first = 0;
    for (std::uint32_t l = 0; l < level; ++l) first += counters->level[l].count;
    counters->level[level].first = first;
  }

  FATHOM_HD void note_base(std::uint32_t k) const {
    if (is_joint(constraints.heads[k].bits)) return;
    const Contact& c = contacts.contacts[constraints.contact[k]];
    if (!c.fixed_a() || c.colour() == overflow_colour || !is_pushable(bodies, c.b) || !touches(k)) return;
    Structure& s = bodies.structures[root_of(bodies.parent, c.b)];
    const Velocity v = bodies.velocities[c.a];
    if (length_squared(v.linear) + length_squared(v.angular) > 0) {
      exec::atomic_min(s.first_base, c.a);
      exec::atomic_max(s.last_base, c.a);
    } else {
      exec::atomic_store(s.rests_on_still, 1u);
    }
    if (is_anew()) exec::atomic_store(bodies.support[c.b].level, 1u);
  }

  FATHOM_HD void note(std::uint32_t i) const {
    if (!is_pushable(bodies, i)) return;
    const std::uint32_t root = root_of(bodies.parent, i);
    bodies.support[i].structure = root;
    Structure& s = bodies.structures[root];
    exec::atomic_max(s.heaviest, __builtin_bit_cast(std::uint32_t, 1.0f / bodies.constants[i].inverse_mass));
    if (bodies.support[i].overloaded == counters->step) exec::atomic_store(s.overloaded, 1u);
  }

  FATHOM_HD void list(std::uint32_t i) const {
    if (!is_pushable(bodies, i)) return;
    BodySupport& s = bodies.support[i];
    Structure& structure = bodies.structures[s.structure];
    if (is_anew() ? structure.overloaded == 0 : s.level == 0) {
      s.level = 0;
      s.held = 0;
      return;
    }
    add_energy(i, structure);
    if (s.level == 0) return;
    Stretch& level = counters->level[s.level];
    const std::uint32_t place =
        is_anew() ? exec::atomic_add(level.count, 1u) : exec::atomic_add(counters->level_cursor[s.level], 1u);
    bodies.by_level[level.first + place] = i;
  }

  /// Mass in units of the heaviest body's, and kinetic energy in units of what that may have (see `is_calm`).
  FATHOM_HD void add_energy(std::uint32_t i, Structure& structure) const {
    constexpr float most_energy = 0.1f;  // J/kg: what is faster has yet to come down
    const Velocity common = common_motion(bodies, structure, i);
    const Vec3 linear = bodies.velocities[i].linear - common.linear;
    const Vec3 angular = bodies.velocities[i].angular - common.angular;
    const Wrench p = SupportMass(bodies, *counters, i).momentum(linear, angular);
    const float energy = 0.5f * (dot(linear, p.force) + dot(angular, p.torque)) / inertia_scale(bodies, *counters, i);
    const float heaviest = __builtin_bit_cast(float, structure.heaviest);
    const float mass = 1.0f / (bodies.constants[i].inverse_mass * heaviest);
    const float share = min(energy / (most_energy * heaviest), 256.0f);
    exec::atomic_add(structure.mass, static_cast<std::uint64_t>(unit * min(mass, 1.0f)));
    exec::atomic_add(structure.energy, static_cast<std::uint64_t>(unit * (share >= 0 ? share : 256.0f)));
  }
  FATHOM_HD static bool is_calm(const Structure& s) { return s.has_one_base() && s.energy <= s.mass; }

  /// Body k of a level: gives those that it carries the next level, and looks for its supports.
  FATHOM_HD void rise(std::uint32_t level, std::uint32_t k) const {
    const Stretch own = counters->level[level];
    const std::uint32_t next_first = own.first + own.count;
    if (k == 0) {
      counters->supported = next_first;
      if (own.count > 32) counters->has_wide_level = 1;
      if (is_anew()) counters->level[level + 1].first = next_first;
    }
    const std::uint32_t i = bodies.by_level[own.first + k];
    const SupportNode& node = bodies.nodes[i];
    const Structure& structure = bodies.structures[bodies.support[i].structure];
    const bool calm = is_calm(structure);
    for (std::uint32_t j = 0; j < node.contacts; ++j) {
      const std::uint32_t contact = constraints.contacts_of[node.first + j];
      if (contact == none) continue;
      if (is_anew() && level < most_levels) lift(contact, i, level, next_first);
      if (calm) stiffen(contact, i, level);
    }
    if (calm) support(i, level, structure);
  }

  FATHOM_HD std::uint32_t other_of(const ConstraintHead& head, std::uint32_t i) const {
    return head.a == i ? head.b : head.a;
  }

  FATHOM_HD void lift(std::uint32_t contact, std::uint32_t i, std::uint32_t level, std::uint32_t next_first) const {
    const ConstraintHead& head = constraints.heads[contact];
    const std::uint32_t other = other_of(head, i);
    if (head.bits & pushes_fixed_bit || !is_pushable(bodies, other) || !touches(contact)) return;
    if (exec::atomic_load(bodies.support[other].level) > 0) return;
    if (exec::atomic_cas(bodies.support[other].level, 0u, level + 1) > 0) return;
    const std::uint32_t place = exec::atomic_add(counters->level[level + 1].count, 1u);
    bodies.by_level[next_first + place] = other;
  }

  /// Of two bodies the one that is not nearer to the ground tells their contact how far they were held.
  FATHOM_HD void stiffen(std::uint32_t contact, std::uint32_t i, std::uint32_t level) const {
    ConstraintHead& head = constraints.heads[contact];
    float held = bodies.support[i].held;
    if (!(head.bits & pushes_fixed_bit)) {
      const std::uint32_t other = other_of(head, i);
      const std::uint32_t other_level = exec::atomic_load(bodies.support[other].level);
      if (other_level == 0 || other_level >= level) return;
      held = min(held, bodies.support[other].held);
    }
    head.set_held(held);
  }

  /// Whether body `other` may carry one of its level's structure.
  FATHOM_HD bool carries(std::uint32_t other, std::uint32_t i, std::uint32_t level) const {
    const std::uint32_t other_level = exec::atomic_load(bodies.support[other].level);
    return other_level > 0 && other_level < level && bodies.nodes[other].is_held() &&
           bodies.support[other].structure == bodies.support[i].structure;
  }
  FATHOM_HD bool is_base(std::uint32_t other, const Structure& s) const {
    if (s.has_moving_base()) return other == s.first_base;
    const Velocity& v = bodies.velocities[other];
    return length_squared(v.linear) + length_squared(v.angular) == 0;
  }

  FATHOM_HD void support(std::uint32_t i, std::uint32_t level, const Structure& structure) const {
    SupportNode& node = bodies.nodes[i];
    std::uint32_t* const mine = constraints.contacts_of + node.first;
    const float scale = inertia_scale(bodies, *counters, i);
    const float body_weight = length(bodies.motion[i].acceleration) * h * scale / bodies.constants[i].inverse_mass;
    Triangle6 m;
    std::uint32_t supports = 0;
    for (std::uint32_t j = 0; j < node.contacts; ++j) {
      const std::uint32_t k = mine[j];
      if (k == none) continue;
      const ConstraintHead& head = constraints.heads[k];
      const bool is_b = head.b == i;
      const std::uint32_t other = other_of(head, i);
      if (!(head.bits & pushes_fixed_bit ? is_base(other, structure) : carries(other, i, level))) continue;
      const ContactImpulses impulses = load_impulses(constraints, k);
      SupportRows r = load_support(constraints, k, is_b);
      weigh_points(r, impulses, touching_points(constraints, k, impulses), body_weight);
      if (!r.holds()) continue;
      add_support(m, r, 0);
      SupportRecord& record = constraints.supports[k];
      for (int p = 0; p < max_manifold_points; ++p) record.weight[p] = r.weight[p];
      record.slide_weight = r.slide_weight;
      record.upper = is_b ? upper_b : upper_a;
      // Supports come first, the others stay in their order.
      for (std::uint32_t q = j; q > supports; --q) mine[q] = mine[q - 1];
      mine[supports++] = k;
    }
    if (supports > 0 && factorise(m, node.factor)) {
      node.supports = supports;
      exec::atomic_max(counters->support_levels, level);
    } else {
      for (std::uint32_t j = 0; j < supports; ++j) constraints.supports[mine[j]].upper = no_upper;
    }
  }
};

}  // namespace fathom::device
