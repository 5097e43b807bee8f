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

/// A quaternion that is nearly of unit length, brought nearer by one Newton step. `normalize` leaves lengths within its
/// square root's rounding as they are, always on the same side.
FATHOM_HD Quat renormalised(Quat q) {
  const float e = -0.5f * fma(q.w, q.w, fma(q.x, q.x, fma(q.y, q.y, fma(q.z, q.z, -1.0f))));
  return {fma(e, q.w, q.w), fma(e, q.x, q.x), fma(e, q.y, q.y), fma(e, q.z, q.z)};
}

/// `q` turned by the rotation vector `phi` in world axes, of unit length. For a constant angular velocity this
/// is exact, where q + ½Δt·Q(q)ω (dissertation, equations 3.8–3.9) lags behind by third order in the angle.
FATHOM_HD Quat turned(Quat q, Vec3 phi) { return normalize(exponential(phi) * q); }

/// What turning by the unit quaternion `q` adds to `v`. Small turns keep the digits that `rotate(q, v) - v` loses.
FATHOM_HD Vec3 turning(Quat q, Vec3 v) {
  const Vec3 u = q.vector();
  const Vec3 t = 2.0f * cross(u, v);
  return mul_add(cross(u, t), q.w, t);
}

/// One torque-free step of length h of a body with inertia `inertia` and its inverse (body axes): turns `q` and
/// changes the angular velocity `w` (world axes). Implicit midpoint rule on SO(3) (Hairer, Lubich, Wanner, "Geometric
/// Numerical Integration", IV.8), by four rounds of its fixed point: second order, angular momentum kept to rounding,
/// energy without drift. It works with differences in body axes: a momentum recomputed from the velocity in every step
/// would lose or gain the rounding of I·I⁻¹ each time, 0.7 % of energy in a minute. Returns the rotation vector of the
/// step (world axes).
FATHOM_HD Vec3 step_torque_free(Quat& q, Vec3& w, const SymMat3& inertia, const SymMat3& inverse_inertia, float h) {
  const Vec3 spin = inverse_rotate(q, w), momentum = inertia * spin;
  Vec3 phi = h * spin;
  for (int i = 0; i < 3; ++i) phi = h * (spin + inverse_inertia * turning(exponential(-0.5f * phi), momentum));
  const Quat turn = exponential(phi);
  const Vec3 after = spin + inverse_inertia * turning(conjugate(turn), momentum);
  const Vec3 turned_by = rotate(q, phi);
  q = renormalised(q * turn);
  w = rotate(q, after);
  return turned_by;
}

}  // namespace fathom
