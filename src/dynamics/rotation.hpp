// Turning bodies, torque-free rotation. Pure, for host and device.
#pragma once

#include <fathom/math.hpp>

#include "dynamics/integrate.hpp"
#include "dynamics/tuning.hpp"

namespace fathom {

/// A quaternion of about unit length, brought nearer by one Newton step; any other is normalised. `normalize` leaves
/// lengths within its square root's rounding as they are, always on the same side.
FATHOM_HD Quat renormalised(Quat q) {
  const float e = -0.5f * fma(q.w, q.w, fma(q.x, q.x, fma(q.y, q.y, fma(q.z, q.z, -1.0f))));
  if (!(abs(e) < 1e-3f)) return normalize(q);
  return {fma(e, q.w, q.w), fma(e, q.x, q.x), fma(e, q.y, q.y), fma(e, q.z, q.z)};
}

/// Parts that a torque-free step has at most.
inline constexpr int max_torque_free_parts = static_cast<int>(max_turn / torque_free_part);

/// A part of `step_torque_free`, of length h: changes the spin (rad/s, body axes) and returns its mean.
FATHOM_HD Vec3 turn_torque_free(Vec3& spin, const SymMat3& inertia, const SymMat3& inverse_inertia, float h) {
  const float half = 0.5f * h, limit = 4.0f * dot(spin, spin);
  Vec3 mean = spin;
  for (int i = 0; i < 4; ++i) {
    const float x = half * half * dot(mean, mean);
    const float tangent = half * fma(x, fma(x, 2.0f / 15.0f, 1.0f / 3.0f), 1.0f);  // tan(½hω) / ω
    mean = mul_add(spin, tangent, inverse_inertia * cross(inertia * mean, mean));
    // No rigid body has such an inertia, or it overflows.
    if (!(dot(mean, mean) <= limit)) return spin;
  }
  Vec3 after = 2.0f * mean - spin;
  // What four rounds leave of the equation must not add up to energy.
  const float energy = dot(spin, inertia * spin), energy_after = dot(after, inertia * after);
  if (abs(energy_after - energy) > 4e-6f * energy) after *= fathom::sqrt(energy / energy_after);
  spin = after;
  return mean;
}

/// One torque-free step of length h of a body with inertia `inertia` and its inverse (body axes): turns `q` and
/// changes the spin (rad/s, body axes). Implicit midpoint rule for Euler's equations, which keeps their quadratic
/// invariants, energy and the momentum's size (Hairer, Lubich, Wanner, "Geometric Numerical Integration", IV.2); turned
/// by its mean spin, with steps lengthened so that this is the Cayley map of the longer step, a body keeps its angular
/// momentum's direction too (Austin, Krishnaprasad, Wang, "Almost Poisson integration of rigid body systems", 1993),
/// and constant spins are exact. Four rounds of a fixed point that converges where a part's angle is below 1, whatever
/// the inertia: I⁻¹(Iω × ω) is no larger than ω², where an iteration on the turned momentum needs h|ω| below the
/// smallest moment over the largest. Fast spins go in parts. Returns the rotation vector of the
/// step (world axes).
FATHOM_HD Vec3 step_torque_free_spin(Quat& q, Vec3& spin, const SymMat3& inertia, const SymMat3& inverse_inertia,
                                     float h) {
  spin = limited(spin, max_torque_free_parts * torque_free_part / h);
  const float angle = h * length(spin);
  int parts = 1;
  while (parts < max_torque_free_parts && angle > static_cast<float>(parts) * torque_free_part) ++parts;
  const float part = h / static_cast<float>(parts);
  Vec3 turned_by;
  for (int i = 0; i < parts; ++i) {
    const Vec3 phi = part * turn_torque_free(spin, inertia, inverse_inertia, part);
    turned_by += rotate(q, phi);
    q = renormalised(q * exponential(phi));
  }
  return turned_by;
}

/// The same of the angular velocity `w` in world axes.
FATHOM_HD Vec3 step_torque_free(Quat& q, Vec3& w, const SymMat3& inertia, const SymMat3& inverse_inertia, float h) {
  Vec3 spin = inverse_rotate(q, w);
  const Vec3 turned_by = step_torque_free_spin(q, spin, inertia, inverse_inertia, h);
  w = rotate(q, spin);
  return turned_by;
}

/// The same of a body in contact, whose contacts see it as it was when the step began, turned by `start`: there `w` is
/// its spin. Were it the true angular velocity, contacts would push against the inertia of one orientation a body that
/// turns with that of another, and what they take from the spin about a rod's axis would come back as much more about
/// the others: energy from nothing, beyond all bounds at 50:1. So the energy that contacts see is the body's.
FATHOM_HD Vec3 step_torque_free_in_contact(Quat& q, Quat start, Vec3& w, const SymMat3& inertia,
                                           const SymMat3& inverse_inertia, float h) {
  Vec3 spin = inverse_rotate(start, w);
  const Vec3 turned_by = step_torque_free_spin(q, spin, inertia, inverse_inertia, h);
  w = rotate(start, spin);
  return turned_by;
}

/// All substeps of length `h` (s) of a body that nothing touches and that has several principal moments: the
/// torque-free turn, damped by the factor `damping` per substep and under the angular acceleration `acceleration`
/// (rad/s²).
FATHOM_HD void spin_freely(Quat& q, Vec3& w, Vec3 acceleration, float damping, const SymMat3& inertia,
                           const SymMat3& inverse_inertia, float h, int substeps, float most) {
  for (int i = 0; i < substeps; ++i) {
    w = limited(mul_add(damping * w, h, acceleration), most);
    step_torque_free(q, w, inertia, inverse_inertia, h);
  }
}

/// The rotation vector (rad) that takes `start` to `q`, of at most three half turns the one nearest to `near`. Rotation
/// vectors of a spin whose axis changes do not add up, and a joint's arms are where the body is.
FATHOM_HD Vec3 turned_so_far(Quat q, Quat start, Vec3 near) {
  Quat turned = q * conjugate(start);
  if (turned.w < 0) turned = {-turned.w, -turned.x, -turned.y, -turned.z};
  const float sine = length(turned.vector());
  if (!(sine > 1e-6f)) return 2 * turned.vector();
  const Vec3 axis = (1 / sine) * turned.vector();
  const float angle = 2 * angle_of(sine, turned.w), about = dot(near, axis);
  return (about > angle + pi ? angle + 2 * pi : about < angle - pi ? angle - 2 * pi : angle) * axis;
}

/// The turn of such a body in a substep in which contacts may touch it (`step_torque_free_in_contact`). It changes the
/// angular velocity, which is no contact's doing, so W's reference follows.
FATHOM_HD Vec3 spin_in_contact(Quat& q, Quat start, Vec3& w, WarmStart& warm, const SymMat3& inertia,
                               const SymMat3& inverse_inertia, float h) {
  const Vec3 before = w;
  const Vec3 turned_by = step_torque_free_in_contact(q, start, w, inertia, inverse_inertia, h);
  warm.angular_reference += w - before;
  return turned_by;
}

}  // namespace fathom
