// Overloaded contacts, and the inertia of their bodies (dynamics/overload.hpp).
#pragma once

#include "device/constraint_rows.hpp"
#include "device/mechanism_arrays.hpp"
#include "dynamics/lift.hpp"
#include "dynamics/overlap.hpp"
#include "exec/atomic.hpp"

namespace fathom::device {

/// Marks the bodies of overloaded contacts for the next step. Supports are searched if a contact is overloaded in two
/// consecutive steps: a hit is over by then.
struct MarkOverload {
  Bodies<body_supports> bodies;
  Constraints<> constraints;
  Mechanisms<> mechanisms;
  Counters* counters;
  float stiffness;  ///< of contacts between bodies that can be pushed (1/s²); 0: nothing is marked
  float dt;         ///< s

  /// Constraint k gave `impulse` (N·s) along its normal over the step.
  FATHOM_HD void operator()(std::uint32_t k, float impulse) const {
    const float gravity = length(counters->gravity);
    if (!(stiffness > 0 && gravity > 0 && impulse > 0)) return;
    const ConstraintHead head = constraints.heads[k];
    const bool fixed_a = head.bits & pushes_fixed_bit;
    const float inverse_a = fixed_a ? 0.0f : bodies.constants[head.a].inverse_mass;
    const float inverse_b = bodies.constants[head.b].inverse_mass, sum = inverse_a + inverse_b;
    const float weight = weight_of(head, gravity);
    const float load = impulse / weight;
    const float half = thinner_half(head);
    const float bodies_stiffness = (fixed_a ? fixed_stiffness_ratio : 1.0f) * stiffness / gravity;
    const bool is_linked = load > pressing_load && mechanisms.solves(k, head.a, head.b, counters->mechanism_links);
    // Avoids the cube root for thick bodies under small loads, the most frequent case.
    if (half * bodies_stiffness > 343 && load <= 12 && !is_linked) return;
    const float swept = sweep_load(half, bodies_stiffness), most = is_linked ? min(pressing_load, swept) : swept;
    if (!(load > most) || is_moving(k, head, loaded_speed)) return;
    if (is_linked && !may_load(k, fixed_a)) return;
    const float lasting = lasting_load(impulse, gained(head.a, inverse_a), gained(head.b, inverse_b));
    const float ratio = lasting / ((is_linked ? most : inertia_load(half, bodies_stiffness)) * weight);
    const std::uint32_t step = counters->step + 1;
    const float heavier = 1 / (fixed_a ? inverse_b : min(inverse_a, inverse_b));  // of the two bodies (kg)
    if (!fixed_a) mark(head.a, step, wanted(head.a, ratio, inverse_a, sum, heavier));
    mark(head.b, step, wanted(head.b, ratio, inverse_b, sum, heavier));
  }
  /// The constraint's lift (m) after the step, at the end of which it is `depth` (m) deep (dynamics/lift.hpp).
  FATHOM_HD float lift(std::uint32_t k, float lift, float depth, float impulse) const {
    const float gravity = length(counters->gravity);
    if (!(stiffness > 0 && gravity > 0 && impulse > 0)) return 0;
    const ConstraintHead head = constraints.heads[k];
    const float half = thinner_half(head);
    if (lift == 0 && !(depth > lasting_depth(half))) return 0;  // most contacts
    if (is_moving(k, head, pressed_speed)) return lift;
    return next_lift(lift, depth, impulse / weight_of(head, gravity), half, dt);
  }

 private:
  FATHOM_HD bool may_load(std::uint32_t k, bool fixed_a) const {
    return !fixed_a && carries_weight(rows_of(constraints, k)[0].xyz(), normalize(-counters->gravity));
  }
  FATHOM_HD float thickness(std::uint32_t i) const { return half_thickness(bodies.constants[i]); }
  /// Weight of the contact's own bodies over a step (N·s).
  FATHOM_HD float weight_of(const ConstraintHead& head, float gravity) const {
    const float inverse_a = head.bits & pushes_fixed_bit ? 0.0f : bodies.constants[head.a].inverse_mass;
    return gravity * dt / (inverse_a + bodies.constants[head.b].inverse_mass);
  }
  /// Half thickness (m) of the thinner body, among those that can be pushed.
  FATHOM_HD float thinner_half(const ConstraintHead& head) const {
    return head.bits & pushes_fixed_bit ? thickness(head.b) : min(thickness(head.a), thickness(head.b));
  }
  /// Whether the bodies' relative speed exceeds `limit` (m/s).
  FATHOM_HD bool is_moving(std::uint32_t k, const ConstraintHead& head, float limit) const {
    Vec3 speed = bodies.solver[head.b].linear.xyz() - bodies.solver[head.a].linear.xyz();
    if (head.has(row_extra)) speed += constraints.extras[k].surface.slide;
    return !(length_squared(speed) <= limit * limit);
  }
  /// Momentum (N·s) gained by the body, with its inertia in this step.
  FATHOM_HD float gained(std::uint32_t i, float inverse_mass) const {
    if (!(inverse_mass > 0)) return 0;
    const Vec3 change = bodies.solver[i].linear.xyz() - bodies.velocities[i].linear;
    return length(change) * inertia_scale(bodies, *counters, i) / inverse_mass;
  }
  FATHOM_HD float wanted(std::uint32_t i, float ratio, float inverse_mass, float inverse_sum, float heavier) const {
    const BodySupport& s = bodies.support[i];
    float most = s.level > 0 ? s.heaviest : 0.0f;
    if (!(most > 0) && mechanisms.stands(i, counters->mechanism_links)) most = heavier;
    return wanted_inertia(ratio, inverse_mass, inverse_sum, most);
  }
  FATHOM_HD void mark(std::uint32_t i, std::uint32_t step, float wanted) const {
    BodySupport& s = bodies.support[i];
    exec::atomic_max(s.load.now, __builtin_bit_cast(std::uint32_t, wanted));
    exec::atomic_store(counters->loaded_step, step);
    const bool lasts = exec::atomic_load(s.overloaded) + 1 == step;
    exec::atomic_store(s.overloaded, step);
    if (!lasts) return;
    exec::atomic_store(counters->overloaded_step, step);
    if (s.level == 0) exec::atomic_store(counters->unlevelled_step, step);
  }
};

}  // namespace fathom::device
