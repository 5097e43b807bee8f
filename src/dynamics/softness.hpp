// Coefficients of soft constraints and of material mixing.
#pragma once

#include <fathom/body.hpp>
#include <fathom/math.hpp>
#include <fathom/world.hpp>

#include "dynamics/tuning.hpp"

namespace fathom {

struct Softness {
  float bias_rate = 0;      ///< 1/s, velocity per separation
  float mass_scale = 1;     ///< factor of the effective mass
  float impulse_scale = 0;  ///< fraction of the accumulated impulse given back in each sweep
};

/// A damped spring of `hertz` and `damping_ratio`, integrated implicitly over `h` seconds (Catto, "Soft
/// Constraints", GDC 2011; in this form Box2D v3's solver).
FATHOM_HD Softness make_soft(float hertz, float damping_ratio, float h) {
  const float omega = 2 * pi * hertz;
  const float a1 = 2 * damping_ratio + h * omega;
  const float a2 = h * omega * a1;
  const float a3 = 1 / (1 + a2);
  return {omega / a1, a2 * a3, a3};
}

/// Softness of the contacts of one step.
struct ContactSoftness {
  Softness dynamic;  ///< between two bodies that can be pushed
  Softness fixed;    ///< against one that cannot
};

/// Frequency of contacts (Hz) over substeps of h seconds: `contact_rate`, unless the application wants them softer.
/// Structures too tall or too heavy for them are held directly (dynamics/support.hpp).
inline float contact_hertz(const SolverSettings& settings, float h) {
  return min(settings.contact_hertz, contact_rate / h);
}

/// Springs against bodies that cannot be pushed have twice the frequency.
inline ContactSoftness contact_softness(const SolverSettings& settings, float h) {
  const float hertz = contact_hertz(settings, h), ratio = settings.contact_damping_ratio;
  return {make_soft(hertz, ratio, h), make_soft(2 * hertz, ratio, h)};
}

/// Depth by which a body sinks into one that cannot be pushed, per m/s² of gravity, until its contact's spring carries
/// it (s²): 1 / ω².
inline float contact_sag(const WorldDef& def) {
  const float omega = 4 * pi * contact_hertz(def.solver, def.dt / static_cast<float>(def.solver.substeps));
  return 1 / (omega * omega);
}

/// Time (s) by which friction extrapolates the arms of kinematic bodies (`carried_speed`): to the middle of the next
/// substep of length `h` (s). Warm starting turns a body that rests on them for one more substep before it moves.
inline float friction_lead(const SolverSettings& settings, float h) {
  return settings.method == Solver::soft && settings.warm_start ? -0.5f * h : 0.5f * h;
}

/// Speed (m/s) below which nothing bounces: at least the speed that gravity adds in a substep, which counts as rest.
inline float bounce_threshold(const WorldDef& def, float h) {
  return max(def.solver.restitution_threshold, h * length(def.gravity));
}

/// The contact's coefficient from those of its two materials; if their rules differ, the later one in CombineRule wins.
FATHOM_HD float combine(float a, float b, CombineRule rule_a, CombineRule rule_b) {
  switch (rule_a > rule_b ? rule_a : rule_b) {
    case CombineRule::average:
      return 0.5f * (a + b);
    case CombineRule::minimum:
      return min(a, b);
    case CombineRule::geometric_mean:
      return fathom::sqrt(a * b);
    case CombineRule::multiply:
      return a * b;
    case CombineRule::maximum:
      break;
  }
  return max(a, b);
}

}  // namespace fathom
