// The rows of one ball joint, for the device and for single joints. Pure.
#pragma once

#include <type_traits>

#include "dynamics/inverse_inertia.hpp"
#include "dynamics/lane_scalar.hpp"
#include "dynamics/softness.hpp"
#include "dynamics/solver_body.hpp"
#include "dynamics/tuning.hpp"

namespace fathom {

#define FATHOM_LANE_FUNCTION FATHOM_HD
#define FATHOM_LANE_LAMBDA
#include "dynamics/ball_joint-inl.hpp"
#undef FATHOM_LANE_FUNCTION
#undef FATHOM_LANE_LAMBDA

/// The two bodies of a joint, with Inertia = float where both are isotropic, else SymMat3.
template <class Inertia>
struct JointBodies {
  static constexpr bool all_isotropic = std::is_same_v<Inertia, float>;
  static constexpr bool only_pushes_b = false;

  struct Side {
    Vec3 linear, angular, moved, turned;
    float inverse_mass = 0;
    float inverse_inertia = 0;  ///< for isotropic bodies and those that cannot be pushed, else 0
    Inertia response{};         ///< the inverse inertia (1/(kg·m²)), in the axes of the spin
  };
  Side a, b;

  FATHOM_HD auto inverse_of_a() const { return fathom::inverse_inertia(a.inverse_mass, a.response); }
  FATHOM_HD auto inverse_of_b() const { return fathom::inverse_inertia(b.inverse_mass, b.response); }
};

/// A row that wants the velocity -bias_rate · separation - compliance · impulse. A rigid joint has no compliance but
/// gives way in proportion to its effective mass, as contacts do; a spring has compliance alone.
struct JointSoftness {
  float bias_rate = 0, mass_scale = 1, impulse_scale = 0;  ///< see Softness
  float compliance = 0;                                    ///< 1/kg or 1/(kg·m²)
};

/// Of a rigid joint, over substeps of h seconds.
FATHOM_HD JointSoftness rigid_joint_softness(float h) {
  const Softness s = make_soft(rigid_joint_rate / h, rigid_joint_damping, h);
  return {s.bias_rate, s.mass_scale, s.impulse_scale, 0};
}

/// Of a spring with the stiffness k = m ω² and the damping c = 2 ζ ω m, integrated implicitly over h seconds. The mass
/// m (kg or kg·m²) belongs to the joint, not to the bodies' placement: a spring whose stiffness turns with the bodies
/// does work (docs/joints.md, Springs).
FATHOM_HD JointSoftness spring_softness(float hertz, float damping_ratio, float mass, float h) {
  const float omega = 2 * pi * hertz, sum = fma(h, omega, 2 * damping_ratio);
  return {omega / sum, 1, 0, min(1 / (h * omega * sum * mass), 3e38f)};
}

/// Highest frequency (Hz) of springs: no joint is stiffer than a rigid one.
FATHOM_HD float joint_hertz(float hertz, float h) { return min(hertz, rigid_joint_rate / h); }

/// Softness of a joint with this frequency (Hz; 0: rigid), damping ratio and mass.
FATHOM_HD JointSoftness joint_softness(float hertz, float damping_ratio, float mass, float h) {
  return hertz > 0 ? spring_softness(joint_hertz(hertz, h), damping_ratio, mass, h) : rigid_joint_softness(h);
}

/// Largest impulse of a spring in a substep of h seconds (N·s); 0 for a rigid joint. A force of 0 gives a tiny impulse.
FATHOM_HD float max_impulse(float hertz, float max_force, float h) {
  return hertz > 0 ? max(max_force * h, 1e-30f) : 0.0f;
}

/// A body under an impulse J per substep of h seconds swings about its anchor with (h ω)² = h J times this (1/(kg·m)),
/// whatever the direction of the pull: the length of its arm times the inverse inertia across it.
FATHOM_HD float swing_rate(Vec3 anchor, const SymMat3& inverse_inertia) {
  const float arm = length(anchor);
  if (!(arm > 0)) return 0;
  const float across = (inverse_inertia.xx + inverse_inertia.yy + inverse_inertia.zz) * arm -
                       dot(anchor, inverse_inertia * anchor) / arm;
  return 0.5f * across;
}

/// The largest impulse (N·s) with which sweeps begin a step. The last substep's impulse acts again, at arms that have
/// turned since. Where a light body would swing under it faster than a substep can follow, (h ω)² > 1, it would fling
/// that body around, such as the neck between a landing head and the body behind it. Sweeps find the remainder again.
FATHOM_HD float max_start(float swing_rate, float h) {
  return swing_rate * h > 1e-38f ? min(1 / (swing_rate * h), 3e38f) : 3e38f;
}
/// Fraction of an impulse of this size (squared) with which they begin.
FATHOM_HD float start_share(float size_squared, float most) {
  return size_squared > most * most ? most / fathom::sqrt(size_squared) : 1.0f;
}

}  // namespace fathom
