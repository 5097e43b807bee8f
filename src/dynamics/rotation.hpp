// Turning bodies: the exponential map and torque-free rotation. Pure, for host and device.
#pragma once

#include <fathom/math.hpp>

namespace fathom {

/// Rotation by the vector `phi` (rad, world axes), |phi| ≤ 2π, as cos and sin of half the angle from their series,
/// so that every target computes the same bits. Exact to 1e-7 up to |phi| = π, to 1e-4 up to 2π.
FATHOM_HD Quat exponential(Vec3 phi) {
  const float x = 0.25f * dot(phi, phi);  // half the angle, squared
  float c = fma(x, 1.0f / 479001600.0f, -1.0f / 3628800.0f);
  c = fma(x, c, 1.0f / 40320.0f);
  c = fma(x, c, -1.0f / 720.0f);
  c = fma(x, c, 1.0f / 24.0f);
  c = fma(x, c, -0.5f);
  c = fma(x, c, 1.0f);
  float s = fma(x, 1.0f / 6227020800.0f, -1.0f / 39916800.0f);
  s = fma(x, s, 1.0f / 362880.0f);
  s = fma(x, s, -1.0f / 5040.0f);
  s = fma(x, s, 1.0f / 120.0f);
  s = fma(x, s, -1.0f / 6.0f);
  s = 0.5f * fma(x, s, 1.0f);
  return {c, s * phi.x, s * phi.y, s * phi.z};
}

/// `q` turned by the rotation vector `phi` in world axes, of unit length. For a constant angular velocity this
/// is exact, where q + ½Δt·Q(q)ω (dissertation, equations 3.8–3.9) lags behind by third order in the angle.
FATHOM_HD Quat turned(Quat q, Vec3 phi) { return normalize(exponential(phi) * q); }

/// One torque-free step of length h of a body with inertia `inertia` and its inverse (body axes): turns `q` and
/// changes the angular velocity `w` (world axes) so that the angular momentum in world axes stays what it was to
/// rounding, and the energy with it between the bounds L²/2I. The orientation follows the angular velocity of the
/// step's middle, which makes the step second order (explicit midpoint rule on SO(3); Hairer, Lubich, Wanner,
/// "Geometric Numerical Integration", IV.8). Returns the rotation vector of the step.
FATHOM_HD Vec3 step_torque_free(Quat& q, Vec3& w, const SymMat3& inertia, const SymMat3& inverse_inertia, float h) {
  const Vec3 momentum = rotate(q, inertia * inverse_rotate(q, w));
  const Quat half_way = turned(q, (0.5f * h) * w);
  const Vec3 phi = h * rotate(half_way, inverse_inertia * inverse_rotate(half_way, momentum));
  q = turned(q, phi);
  w = rotate(q, inverse_inertia * inverse_rotate(q, momentum));
  return phi;
}

}  // namespace fathom
