// The graph of supports (dynamics/support.hpp): which bodies belong to structures, each body's distance from the
// ground, and the factors of their supports' rows.
//
// Only if some contact was overloaded in the previous step; otherwise the kernel has no phases. Nothing depends on the
// order in which items run: lists may be in any order, sums use integers, and each body visits its contacts in the
// order of their colours.
#pragma once

#include "device/support_factors.hpp"
#include "device/tuning.hpp"
#include "device/union_find.hpp"
#include "dynamics/moving_surface.hpp"
#include "exec/bits.hpp"
#include "exec/kernel.hpp"

namespace fathom::device {

/// Bodies forget, contacts join them, structures are noted and their bodies admitted. Then all contacts together lift
/// bodies from level to level, until none is lifted. Bodies are listed by level and look for their supports, and look
/// again while something changes.
struct FindSupports {
  static constexpr bool ends_at_empty_phase = true;
  static constexpr std::uint32_t group_size = 128;
  static constexpr std::uint32_t first_phases = 4;  ///< forget, join, note, admit
  static constexpr std::uint32_t max_phases = first_phases + max_levels + 2 + 1 + max_levels + 1;

  Bodies<body_islands, body_supports, body_state, body_solver> bodies;
  Contacts<> contacts;
  Constraints<constraint_heads, constraint_supports> constraints;
  Counters* counters;
  float h, dt;  ///< s, a substep and a step

  FATHOM_HD std::uint32_t phases() const {
    const bool is_due = counters->overloaded_step == counters->step && counters->constraints > 0;
    return is_due ? max_phases : 0;
  }
  FATHOM_HD std::uint32_t items(std::uint32_t phase) const {
    const std::uint32_t n = counters->live_bodies, m = counters->constraints;
    const auto larger = [](std::uint32_t a, std::uint32_t b) { return a < b ? b : a; };
    switch (turn_of(phase).what) {
      case What::forget:
        return larger(n, level_slots);
      case What::join:
        return larger(n, m);
      case What::note:
        return larger(larger(n, m), level_slots);
      case What::admit:
      case What::list:
        return n;
      case What::lift:
        return m;
      case What::lay_out:
        return level_slots;
      case What::look:
      case What::look_again:
      case What::settle:
        return counters->supported;
      case What::nothing:
        break;
    }
    return 0;
  }
  FATHOM_HD void operator()(std::uint32_t phase, std::uint32_t i) const {
    const bool is_body = i < counters->live_bodies, is_constraint = i < counters->constraints;
    const Turn turn = turn_of(phase);
    switch (turn.what) {
      case What::forget:
        if (i < level_slots) counters->level[i] = {0, 0}, counters->level_cursor[i] = 0;
        if (i == 0) counters->top_level = counters->support_rounds = 0, counters->joined_step = counters->step;
        if (is_body) forget(i);
        break;
      case What::join:
        if (is_constraint) join(i);
        if (is_body && !is_anew()) count(i);
        break;
      case What::note:
        if (i < level_slots && !is_anew()) lay_out_level(i);
        if (is_constraint) note_base(i);
        if (is_body) note(i);
        break;
      case What::admit:
        admit(i);
        break;
      case What::lift:
        lift(i, turn.number);
        break;
      case What::lay_out:
        if (i == 0) exec::atomic_store(counters->top_level, turn.number);
        lay_out_level(i);
        break;
      case What::list:
        list(i);
        break;
      case What::look:
        factors().look(bodies.by_level[i]);
        break;
      case What::look_again:
        factors().look_again(bodies.by_level[i], turn.number);
        break;
      case What::settle:
        factors().settle(bodies.by_level[i]);
        break;
      case What::nothing:
        break;
    }
  }

 private:
  static constexpr float unit = 1u << 30;

  enum class What : std::uint32_t { forget, join, note, admit, lift, lay_out, list, look, look_again, settle, nothing };
  struct Turn {
    What what;
    std::uint32_t number = 0;  ///< the level or round
  };

  /// The work of a phase. The number of levels and rounds becomes known only during the kernel; counters that items of
  /// the current phase write give the same answer before and after.
  FATHOM_HD Turn turn_of(std::uint32_t phase) const {
    if (phase < first_phases) return {static_cast<What>(phase)};
    std::uint32_t k = phase - first_phases;
    if (is_anew()) {
      const std::uint32_t level = k + 1, top = exec::atomic_load(counters->top_level);
      const bool is_over = level > max_levels || exec::atomic_load(counters->level[level].count) == 0;
      if (top == 0 ? !is_over : level < top) return {What::lift, level};
      const std::uint32_t empty = top == 0 ? level : top;
      if (level == empty) return {What::lay_out, empty};
      if (level == empty + 1) return {What::list};
      k = level - (empty + 2);
    }
    if (k == 0) return {What::look};
    const std::uint32_t rounds = exec::atomic_load(counters->support_rounds);
    if (rounds >= k) return {What::look_again, k};
    return {rounds + 1 == k ? What::settle : What::nothing};
  }
  FATHOM_HD SupportFactors factors() const { return {bodies, constraints, counters, h}; }

  /// Whether levels are determined again. Otherwise bodies keep theirs, and a standing structure is held in the same
  /// way.
  FATHOM_HD bool is_anew() const {
    const Counters& c = *counters;
    return c.any_began || c.any_ended || c.step % levels_last == 0 || c.unlevelled_step == c.step ||
           c.held_step != c.step;
  }

  FATHOM_HD void forget(std::uint32_t i) const {
    const bool pushable = is_pushable(bodies, i);
    BodySupport& s = bodies.support[i];
    if (s.held == was_placed)
      s.held = 1;
    else if (counters->held_step != counters->step || s.level == 0)
      s.held = 0;
    // A sleeping body keeps its level: it wakes as part of the same structure.
    if (pushable ? is_anew() : !bodies.constants[i].is_dynamic()) s.level = 0;
    bodies.parent[i] = i;
    bodies.structures[i] = Structure{};
    SupportNode& node = bodies.nodes[i];
    node.supports = node.changed = node.is_settled = 0;
    node.held = 0;
    node.contacts = pushable ? exec::bit_count(bodies.colours[i]) + exec::bit_count(bodies.further[i]) : 0;
    if (node.contacts == 0) return;
    node.first = exec::atomic_add(counters->contacts_listed, node.contacts);
    for (std::uint32_t k = 0; k < node.contacts; ++k) constraints.contacts_of[node.first + k] = none;
  }

  FATHOM_HD bool touches(std::uint32_t k) const {
    return touching_points(constraints, k, load_impulses(constraints, k)) != 0;
  }

  FATHOM_HD void join(std::uint32_t k) const {
    constraints.supports[k].upper = no_upper;
    if (is_joint(constraints.heads[k].bits)) return;  // joints are not supports
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
    const std::uint32_t rank = is_further
                                   ? exec::bit_count(bodies.colours[i]) + exec::bit_count(bodies.further[i] & before)
                                   : exec::bit_count(bodies.colours[i] & before);
    const SupportNode& node = bodies.nodes[i];
    if (rank < node.contacts) constraints.contacts_of[node.first + rank] = k;
  }

  FATHOM_HD void count(std::uint32_t i) const {
    if (bodies.support[i].level > 0 && is_pushable(bodies, i))
      exec::atomic_add(counters->level[bodies.support[i].level].count, 1u);
  }
  FATHOM_HD void lay_out_level(std::uint32_t level) const {
    std::uint32_t first = 0;
    for (std::uint32_t l = 0; l < level; ++l) first += counters->level[l].count;
    counters->level[level].first = first;
    const std::uint32_t own = counters->level[level].count;
    if (own > 32) exec::atomic_store(counters->has_wide_level, 1u);
    if (level + 1 == level_slots) counters->supported = first + own;
  }

  FATHOM_HD void note_base(std::uint32_t k) const {
    if (is_joint(constraints.heads[k].bits)) return;
    const Contact& c = contacts.contacts[constraints.contact[k]];
    if (c.on_moving_surface() && !may_be_base(k, c)) return split(k, c);
    if (!c.fixed_a() || c.colour() == overflow_colour || !is_pushable(bodies, c.b) || !touches(k)) return;
    Structure& s = bodies.structures[root_of(bodies.parent, c.b)];
    const Velocity v = bodies.velocities[c.a];
    if (c.on_moving_surface() || length_squared(v.linear) + length_squared(v.angular) > 0) {
      if (!c.on_moving_surface() && dot(rows_of(constraints, k)[0].xyz(), counters->gravity) > 0) return;  // a press
      note_motion(s, c.a, motion_key(v, c.a, c.on_moving_surface()));
    } else {
      exec::atomic_store(s.rests_on_still, 1u);
    }
    if (is_anew()) exec::atomic_store(bodies.support[c.b].level, 1u);
  }

  /// Whether A's moving surface may carry a body: only if the body's own surface does not move, and A's moves along the
  /// contact plane.
  FATHOM_HD bool may_be_base(std::uint32_t k, const Contact& c) const {
    if (!c.fixed_a() || bodies.constants[c.b].has_moving_surface()) return false;
    const Quad* const rows = rows_of(constraints, k);
    return is_along_surface(constraints.extras[k].surface.slide, rows[0].xyz());
  }
  /// Notes that the bodies of constraint k do not move as one with what their structure rests on.
  FATHOM_HD void split(std::uint32_t k, const Contact& c) const {
    if (!is_pushable(bodies, c.b) || !touches(k)) return;
    Structure& s = bodies.structures[root_of(bodies.parent, c.b)];
    note_motion(s, c.a, c.a);
    exec::atomic_store(s.rests_on_still, 1u);
  }
  FATHOM_HD static void note_motion(Structure& s, std::uint32_t base, std::uint32_t key) {
    exec::atomic_min(s.first_base, base);
    exec::atomic_min(s.first_motion, key);
    exec::atomic_max(s.last_motion, key);
  }

  FATHOM_HD void note(std::uint32_t i) const {
    if (!is_pushable(bodies, i)) return;
    const std::uint32_t root = root_of(bodies.parent, i);
    bodies.support[i].structure = root;
    Structure& s = bodies.structures[root];
    exec::atomic_max(s.heaviest, __builtin_bit_cast(std::uint32_t, 1.0f / bodies.constants[i].inverse_mass));
    if (bodies.support[i].overloaded == counters->step) exec::atomic_store(s.overloaded, 1u);
  }

  FATHOM_HD void admit(std::uint32_t i) const {
    if (!is_pushable(bodies, i)) return;
    BodySupport& s = bodies.support[i];
    Structure& structure = bodies.structures[s.structure];
    s.heaviest = __builtin_bit_cast(float, structure.heaviest);
    if (is_anew() ? structure.overloaded == 0 : s.level == 0) {
      s.level = 0;
      s.held = 0;
      return;
    }
    carry_along(i, structure);
    add_energy(i, structure);
    if (s.level == 0) return;
    if (is_anew())
      exec::atomic_add(counters->level[1].count, 1u);
    else
      list(i);
  }

  FATHOM_HD void list(std::uint32_t i) const {
    const BodySupport& s = bodies.support[i];
    if (s.level == 0 || !is_pushable(bodies, i)) return;
    const std::uint32_t index = exec::atomic_add(counters->level_cursor[s.level], 1u);
    bodies.by_level[counters->level[s.level].first + index] = i;
  }

  /// See `fathom::carried_along`.
  FATHOM_HD void carry_along(std::uint32_t i, const Structure& structure) const {
    const float scale = inertia_scale(bodies, *counters, i), fall = length(counters->gravity) * dt;
    if (!structure.has_one_base()) return;
    const Vec3 base = common_motion(bodies, structure, i).linear;
    Vec3& velocity = bodies.velocities[i].linear;
    const Vec3 change = bodies.support[i].base.change_to(base, velocity, counters->step, fall);
    const CarriedAlong carried = fathom::carried_along(change, scale, fall, dt);
    velocity += carried.gained;
    Quad& linear = bodies.solver[i].linear;
    linear = quad(linear.xyz() + carried.gained, linear.w);
    bodies.motion[i].acceleration += carried.acceleration;
  }
  /// Adds mass in units of the heaviest body's, and kinetic energy in units of its maximum (see `is_calm`).
  FATHOM_HD void add_energy(std::uint32_t i, Structure& structure) const {
    const Velocity common = common_motion(bodies, structure, i);
    const Vec3 linear = bodies.velocities[i].linear - common.linear;
    const Vec3 angular = bodies.velocities[i].angular - common.angular;
    if (structure.has_one_base()) bodies.nodes[i].is_settled = is_settled(linear);
    const Wrench p = SupportMass(bodies, *counters, i).momentum(linear, angular);
    const float energy = 0.5f * (dot(linear, p.force) + dot(angular, p.torque)) / inertia_scale(bodies, *counters, i);
    const float heaviest = __builtin_bit_cast(float, structure.heaviest);
    const float mass = 1.0f / (bodies.constants[i].inverse_mass * heaviest);
    const float share = min(energy / (calm_energy * heaviest), 256.0f);
    exec::atomic_add(structure.mass, static_cast<std::uint64_t>(unit * min(mass, 1.0f)));
    exec::atomic_add(structure.energy, static_cast<std::uint64_t>(unit * (share >= 0 ? share : 256.0f)));
  }
  /// If one of two bodies that press on each other has this level, gives the other the next, unless it has one.
  FATHOM_HD void lift(std::uint32_t k, std::uint32_t level) const {
    const PairRecord pair = constraints.bodies[k];
    const std::uint32_t level_a = exec::atomic_load(bodies.support[pair.a].level);
    const std::uint32_t level_b = exec::atomic_load(bodies.support[pair.b].level);
    const bool from_a = level_a == level && level_b == 0, from_b = level_b == level && level_a == 0;
    if (!(from_a || from_b) || level == max_levels || !presses(k, pair)) return;
    const std::uint32_t i = from_a ? pair.b : pair.a;
    if (exec::atomic_cas(bodies.support[i].level, 0u, level + 1) == 0)
      exec::atomic_add(counters->level[level + 1].count, 1u);
  }
  /// Whether constraint k is a contact through which one body may carry the other.
  FATHOM_HD bool presses(std::uint32_t k, const PairRecord& pair) const {
    if (is_joint(constraints.heads[k].bits)) return false;
    if (contacts.contacts[constraints.contact[k]].colour() == overflow_colour) return false;
    return is_pushable(bodies, pair.a) && is_pushable(bodies, pair.b) && touches(k);
  }
};

}  // namespace fathom::device
