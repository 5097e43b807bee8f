// The rows of one ball joint, for the device and for single joints. Pure.
#pragma once

#include <type_traits>

#include "dynamics/joint_limits.hpp"
#include "dynamics/lane_scalar.hpp"
#include "dynamics/softness.hpp"
#include "dynamics/solver_body.hpp"

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
    float inverse_inertia = 0;  ///< of isotropic bodies and of those that cannot be pushed; of others 0
    Inertia response{};         ///< the inverse inertia (1/(kg·m²)), as the spin is written
  };
  Side a, b;

  FATHOM_HD Vec3 turn_a(Vec3 torque) const { return a.response * torque; }
  FATHOM_HD Vec3 turn_b(Vec3 torque) const { return b.response * torque; }
};

/// A rigid joint is a spring too: with this part of the rate of substeps for its frequency, and this damping ratio.
///
/// One sweep leaves most of what a long chain's slow motions want, and warm starting adds up what it does. Per substep,
/// with a share k of such a motion solved by a sweep, the gap x follows D³x + a D²x + k (1 + s) Dx + k s b x = 0, where
/// a, s and b are the softness' impulse scale, mass scale and bias rate times h. That is stable for every k where
/// (h ω)² < 1 + s. A joint that gave nothing back (a = 0) would blow up from chains of five on.
inline constexpr float rigid_joint_rate = 0.22f, rigid_joint_damping = 0.6f;

/// Of a joint with this frequency (Hz; 0: rigid) and damping ratio, over substeps of h seconds. No joint is stiffer
/// than a rigid one.
FATHOM_HD Softness joint_softness(float hertz, float damping_ratio, float h) {
  const float rigid = rigid_joint_rate / h;
  return hertz > 0 ? make_soft(min(hertz, rigid), damping_ratio, h) : make_soft(rigid, rigid_joint_damping, h);
}

}  // namespace fathom
