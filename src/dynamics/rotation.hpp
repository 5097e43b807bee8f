// Torque-free rotation (dynamics/rotation-inl.hpp) of one body. Pure, for host and device.
#pragma once

#include <fathom/math.hpp>

#include "dynamics/integrate.hpp"
#include "dynamics/tuning.hpp"

namespace fathom {

FATHOM_HD Quat select(bool mask, const Quat& a, const Quat& b) { return mask ? a : b; }

#define FATHOM_LANE_FUNCTION FATHOM_HD
#include "dynamics/rotation-inl.hpp"
#undef FATHOM_LANE_FUNCTION

/// The same in world axes only, for a body that nothing touches: `w` is its angular velocity.
FATHOM_HD Vec3 step_torque_free(Quat& q, Vec3& w, const SymMat3& inertia, const SymMat3& inverse_inertia, float h) {
  Vec3 spin = inverse_rotate(q, w);
  const Vec3 turned_by = step_torque_free_spin(q, spin, inertia, inverse_inertia, h);
  w = rotate(q, spin);
  return turned_by;
}

/// All substeps of length `h` (s) of a body with several principal moments that nothing touches: the torque-free
/// rotation, damped by the factor `damping` per substep and under the angular acceleration `acceleration` (rad/s²).
FATHOM_HD void spin_freely(Quat& q, Vec3& w, Vec3 acceleration, float damping, const SymMat3& inertia,
                           const SymMat3& inverse_inertia, float h, int substeps, float most) {
  for (int i = 0; i < substeps; ++i) {
    w = limited(mul_add(damping * w, h, acceleration), most);
    step_torque_free(q, w, inertia, inverse_inertia, h);
  }
}

/// The rotation of such a body in a substep in which contacts may touch it (`step_torque_free_in_contact`). Its change
/// of angular velocity is not due to contacts, so W's reference follows.
FATHOM_HD Vec3 spin_in_contact(Quat& q, Quat start, Vec3& w, WarmStart& warm, const SymMat3& inertia,
                               const SymMat3& inverse_inertia, float h) {
  const Vec3 before = w;
  const Vec3 turned_by = step_torque_free_in_contact(q, start, w, inertia, inverse_inertia, h);
  warm.angular_reference += w - before;
  return turned_by;
}

}  // namespace fathom
