// Which contacts of a body are its supports, and the factors of their rows (dynamics/support.hpp).
//
// Whether a body is held depends on those that carry it, so it is determined from the ground up. But nearly always all
// of them are held. So every body first assumes that, all at once, and a body with a carrier that is not held looks
// again. The result is the same as going from level to level.
#pragma once

#include "device/support_rows.hpp"

namespace fathom::device {

struct SupportFactors {
  Bodies<body_supports> bodies;
  Constraints<constraint_heads, constraint_supports> constraints;
  Counters* counters;
  float h;  ///< s, a substep

  /// Looks for the supports of body `i`, round 0, and stores in its contacts how far they were held.
  FATHOM_HD void look(std::uint32_t i) const {
    const Structure& structure = structure_of(i);
    if (!is_calm(structure)) return;
    const std::uint32_t level = bodies.support[i].level;
    const SupportNode& node = bodies.nodes[i];
    for (std::uint32_t j = 0; j < node.contacts; ++j) {
      const std::uint32_t k = constraints.contacts_of[node.first + j];
      if (k != none) stiffen(k, i, level);
    }
    if (!support(i, structure, false)) note_change(i, 0);
  }

  /// Looks again if a body that carries `i` has changed in the previous round or since.
  FATHOM_HD void look_again(std::uint32_t i, std::uint32_t round) const {
    const Structure& structure = structure_of(i);
    if (!is_calm(structure) || !has_changed_carrier(i, round)) return;
    const bool was_held = bodies.nodes[i].is_held();
    if (support(i, structure, true) != was_held) note_change(i, round);
  }

  /// Moves supports to the front of a body's contacts; the others keep their order.
  FATHOM_HD void settle(std::uint32_t i) const {
    const SupportNode& node = bodies.nodes[i];
    if (!node.is_held()) return;
    exec::atomic_max(counters->support_levels, bodies.support[i].level);
    std::uint32_t* const mine = constraints.contacts_of + node.first;
    std::uint32_t supports = 0;
    for (std::uint32_t j = 0; supports < node.supports; ++j) {
      const std::uint32_t k = mine[j];
      if (k == none || !is_upper(k, i)) continue;
      for (std::uint32_t q = j; q > supports; --q) mine[q] = mine[q - 1];
      mine[supports++] = k;
    }
  }

 private:
  FATHOM_HD const Structure& structure_of(std::uint32_t i) const {
    return bodies.structures[bodies.support[i].structure];
  }
  FATHOM_HD static bool is_calm(const Structure& s) { return s.has_one_base() && s.energy <= s.mass; }
  FATHOM_HD static std::uint32_t other_of(const ConstraintHead& head, std::uint32_t i) {
    return head.a == i ? head.b : head.a;
  }
  FATHOM_HD bool is_upper(std::uint32_t k, std::uint32_t i) const {
    return constraints.supports[k].upper == (constraints.heads[k].b == i ? upper_b : upper_a);
  }

  FATHOM_HD void note_change(std::uint32_t i, std::uint32_t round) const {
    exec::atomic_store(bodies.nodes[i].changed, round + 1);
    exec::atomic_store(counters->support_rounds, round + 1);
  }
  FATHOM_HD bool has_changed_carrier(std::uint32_t i, std::uint32_t round) const {
    const SupportNode& node = bodies.nodes[i];
    const std::uint32_t level = bodies.support[i].level;
    bool has = false;
    for (std::uint32_t j = 0; j < node.contacts; ++j) {
      const std::uint32_t k = constraints.contacts_of[node.first + j];
      if (k == none || constraints.heads[k].bits & pushes_fixed_bit) continue;
      const std::uint32_t other = other_of(constraints.heads[k], i);
      has |= may_carry(other, i, level) && exec::atomic_load(bodies.nodes[other].changed) >= round;
    }
    return has;
  }

  /// The body farther from the ground stores in the contact how far both were held.
  FATHOM_HD void stiffen(std::uint32_t contact, std::uint32_t i, std::uint32_t level) const {
    ConstraintHead& head = constraints.heads[contact];
    if (head.held() > 0) return;  // a mechanism solves it
    float held = bodies.support[i].held;
    if (!(head.bits & pushes_fixed_bit)) {
      const BodySupport& other = bodies.support[other_of(head, i)];
      if (other.level == 0 || other.level >= level) return;
      held = min(held, other.held);
    }
    head.set_held(held);
  }

  /// Whether body `other`, if it is held, may carry `i` of this level.
  FATHOM_HD bool may_carry(std::uint32_t other, std::uint32_t i, std::uint32_t level) const {
    const BodySupport& s = bodies.support[other];
    return s.level > 0 && s.level < level && s.structure == bodies.support[i].structure;
  }
  FATHOM_HD bool is_held(std::uint32_t i) const { return exec::atomic_load(bodies.nodes[i].supports) > 0; }
  FATHOM_HD bool is_base(std::uint32_t other, const Structure& s) const {
    const Velocity& v = bodies.velocities[other];
    if (s.has_moving_base()) return other == s.first_base || motion_key(v, other, false) == s.first_motion;
    return length_squared(v.linear) + length_squared(v.angular) == 0;
  }
  /// Whether body `i` may rest on the other body of contact k.
  FATHOM_HD bool may_hold(std::uint32_t k, std::uint32_t i, std::uint32_t level, const Structure& structure) const {
    const ConstraintHead& head = constraints.heads[k];
    const std::uint32_t other = other_of(head, i);
    return head.bits & pushes_fixed_bit ? is_base(other, structure) : may_carry(other, i, level);
  }

  FATHOM_HD float speed_of(std::uint32_t i, const Structure& structure, Vec3 arm) const {
    const Velocity &v = bodies.velocities[i], common = common_motion(bodies, structure, i);
    return support_speed(v.linear - common.linear, v.angular - common.angular, arm);
  }
  FATHOM_HD float max_load(std::uint32_t k, const Structure& structure, const SupportRows& r, bool b_is_upper) const {
    const ConstraintHead& head = constraints.heads[k];
    const Quad mass = rows_of(constraints, k)[mass_row * tile_width];
    const float fall = length(counters->gravity) * h;
    float speed = speed_of(b_is_upper ? head.b : head.a, structure, r.arm_upper);
    if (!(head.bits & pushes_fixed_bit))
      speed = max(speed, speed_of(b_is_upper ? head.a : head.b, structure, r.arm_lower));
    return min(fathom::max_load(b_is_upper ? mass.z : mass.x, r.arm_upper, speed, fall, h),
               fathom::max_load(b_is_upper ? mass.x : mass.z, r.arm_lower, speed, fall, h));
  }

  /// Whether body `i` is held: by bodies known to be held themselves or, unless `is_known`, by any.
  FATHOM_HD bool support(std::uint32_t i, const Structure& structure, bool is_known) const {
    SupportNode& node = bodies.nodes[i];
    const std::uint32_t* const mine = constraints.contacts_of + node.first;
    const std::uint32_t level = bodies.support[i].level;
    const float scale = inertia_scale(bodies, *counters, i);
    const float body_weight = length(bodies.motion[i].acceleration) * h * scale / bodies.constants[i].inverse_mass;
    Triangle6 m;
    std::uint32_t supports = 0;
    for (std::uint32_t j = 0; j < node.contacts; ++j) {
      const std::uint32_t k = mine[j];
      if (k == none || !may_hold(k, i, level, structure)) continue;
      SupportRecord& record = constraints.supports[k];
      record.upper = no_upper;
      const ConstraintHead& head = constraints.heads[k];
      if (is_known && !(head.bits & pushes_fixed_bit) && !is_held(other_of(head, i))) continue;
      const bool is_b = head.b == i;
      const ContactImpulses impulses = load_impulses(constraints, k);
      SupportRows r = load_support(constraints, k, is_b);
      weigh_points(r, impulses, touching_points(constraints, k, impulses), body_weight);
      if (!r.holds()) continue;
      add_support(m, r, 0);
      for (int p = 0; p < max_manifold_points; ++p) record.weight[p] = r.weight[p];
      record.slide_weight = r.slide_weight;
      record.max_load = max_load(k, structure, r, is_b);
      record.upper = is_b ? upper_b : upper_a;
      ++supports;
    }
    const bool holds = supports > 0 && factorise(m, node.factor);
    for (std::uint32_t j = 0; !holds && supports > 0 && j < node.contacts; ++j)
      if (mine[j] != none && may_hold(mine[j], i, level, structure)) constraints.supports[mine[j]].upper = no_upper;
    exec::atomic_store(node.supports, holds ? supports : 0u);
    return holds;
  }
};

}  // namespace fathom::device
