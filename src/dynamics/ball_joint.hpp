// The rows of one ball joint, for the device and for single joints. Pure.
#pragma once

#include <type_traits>

#include "dynamics/softness.hpp"
#include "dynamics/solver_body.hpp"

namespace fathom {

// What the law asks of L, for one lane.
template <class L>
using VecOf = Vec3;
template <class L>
FATHOM_HD L splat(float value) {
  return value;
}
FATHOM_HD Vec3 scale(float s, Vec3 a) { return s * a; }
FATHOM_HD float mul_add(float a, float s, float b) { return fma(s, b, a); }
FATHOM_HD float root(float a) { return fathom::sqrt(a); }
FATHOM_HD float larger(float a, float b) { return max(a, b); }
FATHOM_HD float inverse_or_zero(float a) { return a > 0 ? 1.0f / a : 0.0f; }
FATHOM_HD float one_where_zero(float a) { return a == 0 ? 1.0f : 0.0f; }

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
    float inverse_inertia = 0;  ///< of isotropic bodies and of those that cannot be pushed; of others 0
    Inertia response{};         ///< the inverse inertia (1/(kg·m²)), as the spin is written
  };
  Side a, b;

  FATHOM_HD Vec3 turn_a(Vec3 torque) const { return a.response * torque; }
  FATHOM_HD Vec3 turn_b(Vec3 torque) const { return b.response * torque; }
};

/// Of the rate of substeps: as stiff a spring as sweeps hold. A chain of 50 bodies comes apart with stiffer ones, whatever
/// their damping, and stands with these (docs/log/2026-11-22-joints.md); Box3D has the same bound.
inline constexpr float joint_rate_share = 0.25f, rigid_damping_ratio = 5;

/// Of a joint with this frequency (Hz; 0: as stiff as can be) and damping ratio, over substeps of h seconds.
FATHOM_HD Softness joint_softness(float hertz, float damping_ratio, float h) {
  const float stiffest = joint_rate_share / h;
  return hertz > 0 ? make_soft(min(hertz, stiffest), damping_ratio, h) : make_soft(stiffest, rigid_damping_ratio, h);
}

}  // namespace fathom
