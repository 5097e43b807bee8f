// Which contacts carry more than sweeps alone can (dynamics/support.hpp).
#pragma once

#include "device/constraint_rows.hpp"
#include "dynamics/overlap.hpp"
#include "exec/atomic.hpp"

namespace fathom::device {

/// Marks the bodies of overloaded contacts for the next step. Supports are looked for where one has been overloaded in
/// two steps on end: a hit is over by then.
struct MarkOverload {
  BodyArrays bodies;
  ConstraintArrays constraints;
  Counters* counters;
  float stiffness;  ///< of contacts between bodies that can be pushed (1/s²); 0: nothing is marked
  float dt;         ///< s

  /// Constraint k gave `impulse` (N·s) along its normal over the step.
  FATHOM_HD void operator()(std::uint32_t k, float impulse) const {
    const float gravity = length(counters->gravity);
    if (!(stiffness > 0 && gravity > 0 && impulse > 0)) return;
    const ConstraintHead head = constraints.heads[k];
    const bool fixed_a = head.bits & pushes_fixed_bit;
    const Quad masses = rows_of(constraints, k)[mass_row * tile_width];
    const float inverse_mass = masses.x + masses.z;
    const float load = impulse * inverse_mass / (gravity * dt);  // in weights of the contact's own bodies
    const float half = fixed_a ? thickness(head.b) : min(thickness(head.a), thickness(head.b));
    const float bodies_stiffness = (fixed_a ? fixed_stiffness_ratio : 1.0f) * stiffness / gravity;
    // No need to take the cube root for thick bodies, which are most, where the load is small.
    if (half * bodies_stiffness > 343 && load <= 12) return;
    if (!(load > sweep_load(half, bodies_stiffness)) || is_fast(head.a) || is_fast(head.b)) return;
    const std::uint32_t step = counters->step + 1;
    if (!fixed_a) mark(head.a, step);
    mark(head.b, step);
  }

 private:
  FATHOM_HD float thickness(std::uint32_t i) const {
    const BodyConstants& c = bodies.constants[i];
    return half_thickness(c.shape(), c.half_extents, c.shape_radius, c.radius);
  }
  FATHOM_HD bool is_fast(std::uint32_t i) const {
    constexpr float speed = 1;  // m/s
    return !(length_squared(bodies.solver[i].linear.xyz()) < speed * speed);
  }
  FATHOM_HD void mark(std::uint32_t i, std::uint32_t step) const {
    BodySupport& s = bodies.support[i];
    const bool lasts = exec::atomic_load(s.overloaded) + 1 == step;
    exec::atomic_store(s.overloaded, step);
    if (!lasts) return;
    exec::atomic_store(counters->overloaded_step, step);
    if (s.level == 0) exec::atomic_store(counters->unlevelled_step, step);
  }
};

}  // namespace fathom::device
