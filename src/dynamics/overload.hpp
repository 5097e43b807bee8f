// What a contact carries that sweeps alone cannot carry, and how inert that makes its bodies. Pure, for host and
// device.
//
// A sweep passes on as much momentum as a contact's effective mass has at the speed of approach, and its spring gives
// way in inverse proportion to that mass. So a pebble under a boulder needs as many sweeps as it is lighter, and sinks
// in meanwhile. While a body lies still under such a load it is therefore solved as if it were so much heavier, its
// weight staying what it is: at rest the impulses are those of the true masses, and both convergence and stiffness are
// those of bodies that match their load. What stands on nothing keeps its own mass, and so its momentum. (Inertia added
// in proportion to the load is also what Andrews, Teichmann and Kry, "Geometric Stiffness for Real-time Constrained
// Multibody Dynamics", Computer Graphics Forum 36(2), 2017, use against heavy loads.)
#pragma once

#include <fathom/math.hpp>

#include "dynamics/tuning.hpp"

namespace fathom {

/// What makes sweeps alone too soft for a contact: it carries more than so many times what its two bodies would weigh
/// as one effective mass. A free-standing column of cubes on springs of angular frequency ω buckles like an elastic one
/// when it is about 1.2 (d ω² / g)^⅓ cubes high, d being half a cube's edge, each contact carrying twice as much as it
/// has cubes above (docs/solver.md); and a load compresses a contact, for which a thin body has no room. `stiffness` is
/// ω² / g (1/m), `half_thickness` of the thinner body (m).
FATHOM_HD float sweep_load(float half_thickness, float stiffness) {
  const float x = half_thickness * stiffness;
  // A cube root by Newton's method from below: exact to 1 % between 1 and 10⁶, and the same on every target.
  float root = 1 + 0.02f * min(x, 4000.0f);
  for (int i = 0; i < 12; ++i) root = (2 * root + x / (root * root)) * (1.0f / 3);
  return min(buckling_load * root, thin_load * x);
}

/// Load beyond which a contact makes its bodies more inert, in the unit of `sweep_load`, which it is never below: where
/// its spring gives way by `inertia_compression` of the thinner body's half thickness. That a stack of like bodies
/// sways needs no inertia.
FATHOM_HD float inertia_load(float half_thickness, float stiffness) {
  return max(sweep_load(half_thickness, stiffness), inertia_compression * half_thickness * stiffness);
}

/// What a contact's `impulse` over a step leaves for a load (N·s) when the momentum that its two bodies gained, by all
/// that acts on them, is taken off. Without this a body made inert by a load would hit harder, and so seem to carry
/// more.
FATHOM_HD float lasting_load(float impulse, float gained_a, float gained_b) {
  return max(impulse - (gained_a + gained_b), 0.0f);
}

/// How inert a contact with a lasting load of `ratio` times its `inertia_load` wants one of its bodies, in parts of the
/// body's own inertia: so that the contact gives way by a quarter of what it would under that load, however much it
/// carries. The lighter body takes most of it. `inverse_mass` is the body's true one, `inverse_sum` that of both
/// (1/kg), `heaviest` the mass (kg) of the heaviest body that it is in contact with, directly or through others: no
/// more than `max_inertia` times that is ever of use, and what moves about as it is pressed could otherwise hit ever
/// harder.
FATHOM_HD float wanted_inertia(float ratio, float inverse_mass, float inverse_sum, float heaviest) {
  const float most = max(max_inertia * heaviest * inverse_mass, 1.0f);
  return clamp(fma(4 * (ratio - 1), inverse_mass / inverse_sum, 1.0f), 1.0f, most);
}

/// A body's inertia in parts of its own, from step to step, where contacts want it to be `wanted`. It follows the load
/// slowly: what grows heavier at once while it moves gains energy, and what wavers with each impulse shakes.
FATHOM_HD float next_inertia_scale(float scale, float wanted) {
  return max(clamp(wanted, inertia_decay * scale, inertia_growth * scale), 1.0f);
}

}  // namespace fathom
