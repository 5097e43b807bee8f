// Motion of bodies, over vectors `Vec` of one body (`Vec3`) or of one body per lane (native/lane_functions-inl.hpp,
// native/integrate_bodies.hpp). Included like the constraint laws (dynamics/contact-inl.hpp).

/// The rotation vector `phi` (rad) less whole turns: at most half a turn long. Vectors longer than a million rad, whose
/// own rounding is a tenth of a radian, become zero.
template <class Vec>
FATHOM_LANE_FUNCTION Vec within_half_a_turn(Vec phi) {
  using L = LaneOf<Vec>;
  const L squared = dot(phi, phi), half_turn_squared = splat<L>(pi * pi), one = splat<L>(1.0f);
  if (!any_above(squared, half_turn_squared)) return phi;
  const auto is_far = is_above(squared, half_turn_squared);
  const L angle = select(is_far, root(squared), one);
  // 2π as the sum of two floats (Cody and Waite, "Software Manual for the Elementary Functions", 1980).
  const L turns = whole(mul_add(splat<L>(0.5f), angle, splat<L>(0.15915494f)));
  const L residual = mul_add(mul_sub(angle, turns, splat<L>(6.2831855f)), turns, splat<L>(1.7484556e-7f));
  const L kept = select(is_above(splat<L>(0x1p20f), angle), residual / angle, splat<L>(0.0f));
  return scale(select(is_far, kept, one), phi);
}

/// Rotation by the vector `phi` (rad, world axes): cos and sin of half the angle from their series, with the same bits
/// on every target. Of unit length and exact to 1e-7 for any angle.
template <class Vec>
FATHOM_LANE_FUNCTION QuatOf<Vec> exponential(Vec phi) {
  using L = LaneOf<Vec>;
  phi = within_half_a_turn(phi);
  const L x = splat<L>(0.25f) * dot(phi, phi);  // half the angle, squared
  const auto times_x_plus = [&](L sum, float next) FATHOM_LANE_LAMBDA { return mul_add(splat<L>(next), x, sum); };
  L c = times_x_plus(splat<L>(1.0f / 479001600.0f), -1.0f / 3628800.0f);
  c = times_x_plus(times_x_plus(c, 1.0f / 40320.0f), -1.0f / 720.0f);
  c = times_x_plus(times_x_plus(times_x_plus(c, 1.0f / 24.0f), -0.5f), 1.0f);
  L s = times_x_plus(splat<L>(1.0f / 6227020800.0f), -1.0f / 39916800.0f);
  s = times_x_plus(times_x_plus(s, 1.0f / 362880.0f), -1.0f / 5040.0f);
  s = times_x_plus(times_x_plus(times_x_plus(s, 1.0f / 120.0f), -1.0f / 6.0f), 1.0f);
  const Vec v = scale(splat<L>(0.5f) * s, phi);
  return {c, v.x, v.y, v.z};
}

/// `q` turned by the rotation vector `phi` (rad, world axes), of unit length. For a constant angular velocity this is
/// exact, whereas q + ½Δt·Q(q)ω (dissertation, equations 3.8–3.9) lags by third order in the angle.
template <class Vec>
FATHOM_LANE_FUNCTION QuatOf<Vec> turned(QuatOf<Vec> q, Vec phi) {
  return normalize(exponential(phi) * q);
}

/// Adds `change` to a velocity (m/s). `residual` gets the rounding error, which is added to the next change (Kahan,
/// "Further remarks on reducing truncation errors", 1965). g h is far smaller than the velocity it is added to, and is
/// rounded the same way in every step of a fall, which would change g.
template <class Vec>
FATHOM_LANE_FUNCTION void accelerate(Vec& velocity, Vec& residual, Vec change) {
  const Vec next = velocity + change;
  residual = change - (next - velocity);
  velocity = next;
}

/// Factor by which a substep of length h (s) damps a velocity, implicit: never below zero. `damping` is in 1/s.
template <class L>
FATHOM_LANE_FUNCTION L damping_factor(L damping, L h) {
  const L one = splat<L>(1.0f);
  return one / (one + h * damping);
}

/// The velocity after a substep of length h (s), including `warm`, which contacts and joints gave in the last substep.
template <class Vec>
FATHOM_LANE_FUNCTION Vec substep_velocity(Vec v, Vec acceleration, LaneOf<Vec> damping, LaneOf<Vec> h, Vec warm) {
  return mul_add(scale(damping, v), h, acceleration) + warm;
}

/// `warm`, updated by the change due to contacts and joints since the velocity was `reference`.
template <class Vec>
FATHOM_LANE_FUNCTION Vec carried(Vec warm, Vec v, Vec reference) {
  return warm + (v - reference);
}

/// Mean velocity (m/s) over a substep of length h (s) that ends with `v`, for a body that nothing touched: it moves on
/// an exact parabola. Where contacts act, use `v` itself (symplectic Euler, which contacts need).
template <class Vec>
FATHOM_LANE_FUNCTION Vec mean_velocity(Vec v, Vec acceleration, LaneOf<Vec> h) {
  return mul_add(v, splat<LaneOf<Vec>>(-0.5f) * h, acceleration);
}

/// Whether a step that changed a body's velocity (m/s) from `before` to `after` may have been free movement, which
/// leads to `flown` up to rounding in each substep.
template <class Vec>
FATHOM_LANE_FUNCTION auto may_have_flown(Vec before, Vec after, Vec flown, float substeps) {
  using L = LaneOf<Vec>;
  const L share = splat<L>(substeps * 6e-8f);  // half an ulp each
  const auto is_near = [&](L start, L now, L then) FATHOM_LANE_LAMBDA {
    return is_at_most(magnitude(now - then), share * (magnitude(start) + magnitude(then)));
  };
  return both(both(is_near(before.x, after.x, flown.x), is_near(before.y, after.y, flown.y)),
              is_near(before.z, after.z, flown.z));
}

/// State of a body that nothing touches during a step.
template <class Vec>
struct Flight {
  Vec linear, angular;  ///< m/s, rad/s
  Vec residual;         ///< rounding error of the linear velocity (`accelerate`)
  Vec moved, turned;    ///< m, rad
};

/// Forces on it.
template <class Vec>
struct FlightForces {
  Vec acceleration, angular_acceleration;       ///< m/s², rad/s²
  LaneOf<Vec> linear_damping, angular_damping;  ///< factors per substep
};

/// All substeps of bodies that nothing touches. Without damping the whole path is one exact parabola. Spins are those
/// of isotropic bodies, at most `max_spin` (rad/s); other bodies turn by `spin_freely`.
template <class Vec>
FATHOM_LANE_FUNCTION void fly(Flight<Vec>& f, const FlightForces<Vec>& by, float step, int substeps, float max_spin) {
  using L = LaneOf<Vec>;
  const L dt = splat<L>(step), h = splat<L>(step / static_cast<float>(substeps)), one = splat<L>(1.0f);
  const L zero = splat<L>(0.0f);
  f.moved = f.turned = Vec{zero, zero, zero};
  for (int i = 0; i < substeps; ++i) {
    f.angular = mul_add(scale(by.angular_damping, f.angular), h, by.angular_acceleration);
    f.angular = limited(f.angular, splat<L>(max_spin));
    f.turned = mul_add(f.turned, h, f.angular);
  }
  Flight<Vec> parabola = f;
  accelerate(parabola.linear, parabola.residual, mul_add(f.residual, dt, by.acceleration));
  parabola.moved = scale(dt, mean_velocity(parabola.linear, by.acceleration, dt));
  if (any_above(one, by.linear_damping)) {
    const auto is_damped = is_above(one, by.linear_damping);
    for (int i = 0; i < substeps; ++i) {
      f.linear = mul_add(scale(by.linear_damping, f.linear), h, by.acceleration);
      f.moved = mul_add(f.moved, h, mean_velocity(f.linear, by.acceleration, h));
    }
    parabola.linear = select(is_damped, f.linear, parabola.linear);
    parabola.residual = select(is_damped, Vec{zero, zero, zero}, parabola.residual);
    parabola.moved = select(is_damped, f.moved, parabola.moved);
  }
  f.linear = parabola.linear;
  f.residual = parabola.residual;
  f.moved = parabola.moved;
}
