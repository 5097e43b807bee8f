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

/// The rotation of a body with several principal moments in a substep in which contacts may touch it
/// (`step_torque_free_in_contact`). Its change of angular velocity is not due to contacts, so W's reference follows.
FATHOM_HD Vec3 spin_in_contact(Quat& q, Quat start, Vec3& w, WarmStart& warm, const SymMat3& inertia,
                               const SymMat3& inverse_inertia, float h) {
  const Vec3 before = w;
  const Vec3 turned_by = step_torque_free_in_contact(q, start, w, inertia, inverse_inertia, h);
  warm.angular_reference += w - before;
  return turned_by;
}

}  // namespace fathom
