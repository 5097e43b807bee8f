// Effect of the application's forces and torques on a body. Pure, for host and device.
#pragma once

#include <fathom/math.hpp>

#include "dynamics/inverse_inertia.hpp"

namespace fathom {

/// The application's force and torque on a body in the next step (N, N·m).
struct Force {
  Vec3 force, torque;
};

struct Acceleration {
  Vec3 linear;   ///< m/s²
  Vec3 angular;  ///< rad/s²
};

/// Angular acceleration (rad/s²) due to a torque (N·m), or change of angular velocity due to an angular impulse
/// (N·m·s), both in world axes. `isotropic`: the inverse inertia (1/(kg·m²)) of a body whose tensor is a multiple of
/// the identity, else 0; the tensor is read only if it is 0.
FATHOM_HD Vec3 angular_response(Quat rotation, float isotropic, const SymMat3& inverse_inertia, Vec3 torque) {
  return with_inverse_inertia(0, isotropic, BodyTensor{rotation, inverse_inertia},
                              [&](const auto& inertia) { return inertia.spun_by(torque); });
}

/// Adds the effect of the application's force (N) and torque (N·m, about the centre of mass).
FATHOM_HD void add_forces(Acceleration& to, Quat rotation, float inverse_mass, float isotropic,
                          const SymMat3& inverse_inertia, Vec3 force, Vec3 torque) {
  to.linear = mul_add(to.linear, inverse_mass, force);
  to.angular += angular_response(rotation, isotropic, inverse_inertia, torque);
}

/// Additional movement (m or rad) of a body in a step of length dt, beyond that of its n substeps, where the
/// application's forces act: `before` and `after` are its velocities at the step's ends, `acceleration` is due to
/// everything but contacts. `is_parabola`: the substeps have moved it along an exact parabola.
///
/// A controller computes its force F(x) once per step. Spread over the substeps, so that contacts carry it evenly, a =
/// F/m gives
///     v' = v + a dt,    x' = x + v dt + β a dt²,
/// with β = (n + 1)/(2n), or 1/2 on a parabola. For a spring, a = −ω² x, this map has the determinant
///     det = (1 − β w²) + w² = 1 + (1 − β) w²,    w = ω dt,
/// so with β < 1 every undamped oscillation grows. With β = 1, symplectic Euler over the whole step (Hairer, Lubich,
/// Wanner, "Geometric Numerical Integration", VI.3), det = 1 and the trace is 2 − w²: it is stable for all w < 2. The
/// missing movement is (1 − β) a dt² = (1 − β) dt (v' − v).
///
/// Written with v' − v this also holds in contact: movement that contacts prevent is not added, and a body that is
/// pressed, or floats at rest between weight and buoyancy, stays in place. A collision's change of velocity, however,
/// is not due to a force. Frictionless contacts reduce p = a dt to its projection onto the directions in which the body
/// is free; all projections of p lie on the sphere with diameter p. So v' − v is replaced by the nearest point of that
/// ball.
FATHOM_HD Vec3 missing_movement(Vec3 before, Vec3 after, Vec3 acceleration, bool is_parabola, float dt,
                                float substeps) {
  const Vec3 middle = (0.5f * dt) * acceleration;
  Vec3 off = (after - before) - middle;
  const float most = length_squared(middle), size = length_squared(off);
  if (size > most) off *= fathom::sqrt(most / size);
  const float missing = 0.5f * (substeps - 1) / substeps * dt;
  const Vec3 rest = missing * (middle + off);
  return is_parabola ? mul_add(rest, dt / substeps, middle) : rest;
}

/// Adds `missing_movement` to a body's movement (m) and rotation (rad) in a step where the application's forces act.
/// Velocities are those at the step's ends.
FATHOM_HD void complete_forced(Vec3& moved, Vec3& turned, const Force& f, const Acceleration& a, Vec3 linear_before,
                               Vec3 linear_after, Vec3 angular_before, Vec3 angular_after, bool is_parabola, float dt,
                               float substeps) {
  if (!(f.force == Vec3{})) moved += missing_movement(linear_before, linear_after, a.linear, is_parabola, dt, substeps);
  if (!(f.torque == Vec3{})) turned += missing_movement(angular_before, angular_after, a.angular, false, dt, substeps);
}

}  // namespace fathom
