// Rotation of bodies, torque-free, for one body or eight side by side. Included like dynamics/joint_link-inl.hpp.

/// A quaternion of nearly unit length, improved by one Newton step; any other is normalised. `normalize` leaves lengths
/// within its square root's rounding error unchanged, always on the same side.
FATHOM_LANE_FUNCTION Quat renormalised(const Quat& q) {
  const Real minus_one = splat<Real>(-1.0f);
  const Real e = -0.5f * fma(q.w, q.w, fma(q.x, q.x, fma(q.y, q.y, fma(q.z, q.z, minus_one))));
  const Mask is_near = abs(e) < 1e-3f;
  const Quat near{fma(e, q.w, q.w), fma(e, q.x, q.x), fma(e, q.y, q.y), fma(e, q.z, q.z)};
  return everywhere(is_near) ? near : select(is_near, near, normalize(q));
}

/// One part, of length h, of `step_torque_free`: changes the spin (rad/s, body axes) and returns its mean.
FATHOM_LANE_FUNCTION Vec3 turn_torque_free(Vec3& spin, const SymMat3& inertia, const SymMat3& inverse_inertia, Real h) {
  const Real half = 0.5f * h, limit = 4.0f * dot(spin, spin);
  Vec3 mean = spin;
  Mask is_sound = is_set(all_set);
  for (int i = 0; i < 4; ++i) {
    const Real x = half * half * dot(mean, mean);
    // tan(½hω) / ω
    const Real tangent = half * fma(x, fma(x, splat<Real>(2.0f / 15.0f), splat<Real>(1.0f / 3.0f)), splat<Real>(1.0f));
    mean = mul_add(spin, tangent, inverse_inertia * cross(inertia * mean, mean));
    // Impossible inertia for a rigid body, or an overflow.
    is_sound = both(is_sound, dot(mean, mean) <= limit);
    if (!anywhere(is_sound)) return spin;
  }
  Vec3 after = 2.0f * mean - spin;
  // The error that four rounds leave must not accumulate in the energy.
  const Real energy = dot(spin, inertia * spin), energy_after = dot(after, inertia * after);
  const Mask is_off = abs(energy_after - energy) > 4e-6f * energy;
  if (anywhere(is_off)) after = select(is_off, root(energy / energy_after) * after, after);
  mean = select(is_sound, mean, spin);
  spin = select(is_sound, after, spin);
  return mean;
}

/// One torque-free step of length h for a body with inertia `inertia` and its inverse (body axes): turns `q` and
/// changes the spin (rad/s, body axes). Returns the rotation vector of the step (world axes). The implicit midpoint
/// rule for Euler's equations conserves their quadratic invariants, energy and the size of the momentum (Hairer,
/// Lubich, Wanner, "Geometric Numerical Integration", IV.2). The body turns by its mean spin, with steps lengthened so
/// that this is the Cayley map of the longer step; so it also keeps the direction of its angular momentum (Austin,
/// Krishnaprasad, Wang, "Almost Poisson integration of rigid body systems", 1993), and constant spins are exact. Four
/// fixed-point rounds converge where a part's angle is below 1, whatever the inertia: I⁻¹(Iω × ω) is no larger than ω²,
/// whereas an iteration on the rotated momentum needs h|ω| below the ratio of the smallest to the largest moment. Fast
/// spins take several parts.
FATHOM_LANE_FUNCTION Vec3 step_torque_free_spin(Quat& q, Vec3& spin, const SymMat3& inertia,
                                                const SymMat3& inverse_inertia, Real h) {
  spin = limited(spin, max_torque_free_parts * torque_free_part / h);
  const Real angle = h * length(spin);
  Real parts = splat<Real>(1.0f);
  for (int i = 1; i < max_torque_free_parts; ++i) {
    const Mask is_more = angle > parts * torque_free_part;
    if (!anywhere(is_more)) break;
    parts = select(is_more, parts + 1.0f, parts);
  }
  const Real part = h / parts;
  Vec3 turned_by;
  for (int i = 0; i < max_torque_free_parts; ++i) {
    const Mask turns = parts > static_cast<float>(i);
    if (!anywhere(turns)) break;
    Vec3 next = spin;
    const Vec3 phi = part * turn_torque_free(next, inertia, inverse_inertia, part);
    spin = select(turns, next, spin);
    turned_by = select(turns, turned_by + rotate(q, phi), turned_by);
    q = select(turns, renormalised(q * exponential(phi)), q);
  }
  return turned_by;
}

/// `step_torque_free_spin` in world axes, for a body that nothing touches: `w` is its angular velocity.
FATHOM_LANE_FUNCTION Vec3 step_torque_free(Quat& q, Vec3& w, const SymMat3& inertia, const SymMat3& inverse_inertia,
                                           Real h) {
  Vec3 spin = inverse_rotate(q, w);
  const Vec3 turned_by = step_torque_free_spin(q, spin, inertia, inverse_inertia, h);
  w = rotate(q, spin);
  return turned_by;
}

/// All substeps of length `h` (s) of a body with several principal moments that nothing touches: the torque-free
/// rotation, damped by the factor `damping` per substep and under the angular acceleration `acceleration` (rad/s²).
FATHOM_LANE_FUNCTION void spin_freely(Quat& q, Vec3& w, Vec3 acceleration, Real damping, const SymMat3& inertia,
                                      const SymMat3& inverse_inertia, Real h, int substeps, Real most) {
  for (int i = 0; i < substeps; ++i) {
    w = limited(mul_add(damping * w, h, acceleration), most);
    step_torque_free(q, w, inertia, inverse_inertia, h);
  }
}

/// `step_torque_free` for a body in contact. Contacts see the body in its orientation `start` at the start of the step,
/// and `w` is its spin turned by that. With the true angular velocity, contacts would push a body of one orientation
/// with the inertia of another, and what they remove from the spin about a rod's axis would come back multiplied about
/// the other axes: energy from nothing, unbounded at 50:1. This way the energy that contacts see is the body's.
FATHOM_LANE_FUNCTION Vec3 step_torque_free_in_contact(Quat& q, const Quat& start, Vec3& w, const SymMat3& inertia,
                                                      const SymMat3& inverse_inertia, Real h) {
  Vec3 spin = inverse_rotate(start, w);
  const Vec3 turned_by = step_torque_free_spin(q, spin, inertia, inverse_inertia, h);
  w = rotate(start, spin);
  return turned_by;
}

/// The rotation vector (rad) that takes `start` to `q`, of at most three half turns; of the possible ones, the one
/// nearest to `near`. Rotation vectors of a spin whose axis changes do not add up, and a joint's arms follow the body.
FATHOM_LANE_FUNCTION Vec3 turned_so_far(const Quat& q, const Quat& start, Vec3 near) {
  const Quat product = q * conjugate(start);
  const Quat turned = select(product.w < 0.0f, Quat{-product.w, -product.x, -product.y, -product.z}, product);
  const Real sine = length(turned.vector());
  const Mask has_axis = sine > 1e-6f;
  if (!anywhere(has_axis)) return 2.0f * turned.vector();
  const Vec3 axis = (1.0f / sine) * turned.vector();
  const Real angle = 2.0f * angle_of(sine, turned.w), about = dot(near, axis);
  const Real nearest = select(about > angle + pi, angle + 2 * pi, select(about < angle - pi, angle - 2 * pi, angle));
  return select(has_axis, nearest * axis, 2.0f * turned.vector());
}
