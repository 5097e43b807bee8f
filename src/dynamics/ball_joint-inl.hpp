// The rows of a ball joint over a lane type L: `float`, or a vector register that holds one joint per lane.
//
// No include guard and no namespace: the including file opens the namespace that contains L's functions, once for
// scalars (dynamics/ball_joint.hpp) and once for each instruction set (native/ball_joints-inl.hpp). There,
// FATHOM_LANE_FUNCTION marks the functions.
//
// Three rows hold the anchors x_a + r_a and x_b + r_b together. Arms turn with their bodies within the step, by the
// whole rotation since it began: a pendulum's rod keeps its length at any speed. Spin and inertia of an anisotropic
// body are expressed in its orientation at the start of the step (`step_torque_free_in_contact`); the joint rotates
// them.
//
// A substep is a RATTLE step (Andersen, "Rattle: a velocity version of the Shake algorithm", 1983): an impulse along
// the current arms makes the anchors meet where the bodies will have moved to; after they have moved, a second one
// removes the anchors' relative velocity. A swinging body thus keeps its energy; a plain velocity projection takes a
// fraction (h ω)² of it in every substep. Bodies of a directly solved mechanism on which nothing else acts *swing*:
// they move by the mean of their velocities before and after gravity's acceleration, which is second order. Bodies that
// touch something, or are left to sweeps, move by the velocity after it.
//
// Bodies carry the velocity that a substep's impulses gave them into the next substep (`WarmStart`). For a joint that
// is right for the linear velocity but not for the spin: by then the impulse acts along a different arm, and a pendulum
// would gain a fraction h ω² of its momentum every second. The first sweep of a substep corrects the difference.

enum class JointPass {
  soft,     ///< before positions move: pulls the anchors together
  relax,    ///< after they move: removes that pull from the velocities, except a spring's, which stays
  iterate,  ///< both at once, in the `impulse` solver
};

/// State of one joint that outlasts a sweep. Arms and gap are those at the start of the step.
template <class L>
struct BallJointRow {
  VecOf<L> arm_a, arm_b;        ///< m, from the centres of mass, world axes
  VecOf<L> gap;                 ///< m, from A's anchor to B's
  VecOf<L> impulse;             ///< N·s on B, accumulated over the substep
  VecOf<L> total;               ///< N·s, accumulated over the step
  VecOf<L> moment_a, moment_b;  ///< N·m·s, of `impulse` on each body about its centre, in the axes of its spin
  VecOf<L> pull;                ///< m/s², for bodies that swing: acceleration of B relative to A
  L bias_rate, mass_scale, impulse_scale;
  L rigid;       ///< 1, or 0 for a spring
  L most;        ///< N·s, largest impulse of a spring in a substep; 0 for a rigid joint
  L compliance;  ///< 1/kg, of a spring
};

template <class L>
struct UnitQuat {
  L w;
  VecOf<L> v;
};

template <class L>
FATHOM_LANE_FUNCTION VecOf<L> turned_by(const UnitQuat<L>& q, VecOf<L> a) {
  const VecOf<L> t = scale(splat<L>(2.0f), cross(q.v, a));
  return mul_add(a, q.w, t) + cross(q.v, t);
}
template <class L>
FATHOM_LANE_FUNCTION VecOf<L> turned_back_by(const UnitQuat<L>& q, VecOf<L> a) {
  return turned_by(UnitQuat<L>{splat<L>(0.0f) - q.w, q.v}, a);
}

template <class L>
FATHOM_LANE_FUNCTION UnitQuat<L> squared(const UnitQuat<L>& q) {
  return {q.w * q.w - dot(q.v, q.v), scale(q.w + q.w, q.v)};
}

template <class L>
FATHOM_LANE_FUNCTION VecOf<L> zero_vector() {
  const L zero = splat<L>(0.0f);
  return {zero, zero, zero};
}
template <class L>
FATHOM_LANE_FUNCTION VecOf<L> negated(VecOf<L> v) {
  return zero_vector<L>() - v;
}

/// Rotation by the vector `phi` (rad), shortened to two turns if it is longer. Computes the quaternion with an eighth
/// of it as half the angle, where a few terms of the series give full precision, and squares it twice.
template <class L>
FATHOM_LANE_FUNCTION UnitQuat<L> rotation_by(VecOf<L> phi) {
  const L longest = splat<L>(157.9f);  // (4π)²
  const L size_squared = dot(phi, phi);
  const L shrink = root(longest / larger(size_squared, longest));
  phi = scale(shrink * splat<L>(0.125f), phi);
  const L x = dot(phi, phi);
  L c = mul_add(splat<L>(-1.0f / 3628800.0f), x, splat<L>(1.0f / 479001600.0f));
  c = mul_add(splat<L>(1.0f / 40320.0f), x, c);
  c = mul_add(splat<L>(-1.0f / 720.0f), x, c);
  c = mul_add(splat<L>(1.0f / 24.0f), x, c);
  c = mul_add(splat<L>(-0.5f), x, c);
  c = mul_add(splat<L>(1.0f), x, c);
  L s = mul_add(splat<L>(1.0f / 362880.0f), x, splat<L>(-1.0f / 39916800.0f));
  s = mul_add(splat<L>(-1.0f / 5040.0f), x, s);
  s = mul_add(splat<L>(1.0f / 120.0f), x, s);
  s = mul_add(splat<L>(-1.0f / 6.0f), x, s);
  s = mul_add(splat<L>(1.0f), x, s);
  return squared(squared(UnitQuat<L>{c, scale(s, phi)}));
}

/// The frame in which a body's spin and inverse inertia are expressed: for an anisotropic body the one at the start of
/// the step, which turns with it; otherwise the world. `all_isotropic`: no lane holds an anisotropic body.
template <class L, bool all_isotropic>
struct SpinFrame {
  UnitQuat<L> spin;  ///< from that frame to the world

  /// `turned`: rotation since the step began; `Side` has an inverse_inertia, zero for anisotropic bodies.
  template <class Side>
  FATHOM_LANE_FUNCTION SpinFrame(const UnitQuat<L>& turned, const Side& side) {
    if constexpr (all_isotropic) return;
    const L one = splat<L>(1.0f), anisotropic = one_where_zero(side.inverse_inertia);
    spin.w = mul_add(one, anisotropic, turned.w - one);
    spin.v = scale(anisotropic, turned.v);
  }
  FATHOM_LANE_FUNCTION VecOf<L> in_world(VecOf<L> v) const {
    if constexpr (all_isotropic)
      return v;
    else
      return turned_by(spin, v);
  }
  FATHOM_LANE_FUNCTION VecOf<L> from_world(VecOf<L> v) const {
    if constexpr (all_isotropic)
      return v;
    else
      return turned_back_by(spin, v);
  }

  // Effect of an impulse (world axes) whose moment is given in the axes of the spin.

  /// Change of angular velocity, in the same axes.
  template <class Inertia>
  FATHOM_LANE_FUNCTION VecOf<L> spun_by(const Inertia& inertia, VecOf<L> impulse, VecOf<L> moment) const {
    if constexpr (Inertia::couples)
      return inertia.spun_by(from_world(impulse), moment);
    else
      return inertia.spun_by(moment);
  }
  /// Change of linear velocity, in world axes.
  template <class Inertia>
  FATHOM_LANE_FUNCTION VecOf<L> moved_by(const Inertia& inertia, VecOf<L> impulse, VecOf<L> moment) const {
    if constexpr (Inertia::couples)
      return in_world(inertia.moved_by(from_world(impulse), moment));
    else
      return inertia.moved_by(impulse, moment);
  }
  /// `linear` plus that change.
  template <class Inertia>
  FATHOM_LANE_FUNCTION VecOf<L> moved(VecOf<L> linear, const Inertia& inertia, VecOf<L> impulse,
                                      VecOf<L> moment) const {
    if constexpr (Inertia::couples)
      return linear + moved_by(inertia, impulse, moment);
    else
      return mul_add(linear, inertia.mass, impulse);
  }
  /// Applies it to a body.
  template <class Side, class Inertia>
  FATHOM_LANE_FUNCTION void push(Side& side, const Inertia& inertia, VecOf<L> impulse, VecOf<L> moment) const {
    side.linear = moved(side.linear, inertia, impulse, moment);
    side.angular = side.angular + spun_by(inertia, impulse, moment);
  }
};

/// One body of a joint: its current arm, and the frame of its spin.
template <class L, bool all_isotropic>
struct JointArm {
  VecOf<L> arm;  ///< m, current
  SpinFrame<L, all_isotropic> frame;

  template <class Side>
  FATHOM_LANE_FUNCTION JointArm(const Side& side, VecOf<L> arm_at_start)
      : JointArm(rotation_by<L>(side.turned), side, arm_at_start) {}
  /// The body's angular velocity in world axes.
  FATHOM_LANE_FUNCTION VecOf<L> in_world(VecOf<L> angular) const { return frame.in_world(angular); }
  /// The moment of an impulse at the anchor about the body's centre, in the axes of the spin.
  FATHOM_LANE_FUNCTION VecOf<L> moment_of(VecOf<L> impulse) const { return frame.from_world(cross(arm, impulse)); }
  /// Velocity of the anchor due to an impulse there.
  template <class Inertia>
  FATHOM_LANE_FUNCTION VecOf<L> response(VecOf<L> impulse, const Inertia& inertia) const {
    const VecOf<L> moment = moment_of(impulse);
    return frame.moved(cross(in_world(frame.spun_by(inertia, impulse, moment)), arm), inertia, impulse, moment);
  }

 private:
  template <class Side>
  FATHOM_LANE_FUNCTION JointArm(const UnitQuat<L>& turned, const Side& side, VecOf<L> arm_at_start)
      : arm(turned_by(turned, arm_at_start)), frame(turned, side) {}
};

/// x with K x = v, for a symmetric positive definite K given by its columns; zero where there is no solution.
template <class L>
FATHOM_LANE_FUNCTION VecOf<L> solved(VecOf<L> kx, VecOf<L> ky, VecOf<L> kz, VecOf<L> v) {
  // Scaled to a trace of one, because products of three elements may overflow or underflow.
  const L scaling = inverse_or_zero(kx.x + (ky.y + kz.z));
  kx = scale(scaling, kx), ky = scale(scaling, ky), kz = scale(scaling, kz);
  const VecOf<L> yz = cross(ky, kz), zx = cross(kz, kx), xy = cross(kx, ky);
  return scale(scaling * inverse_or_zero(dot(kx, yz)), VecOf<L>{dot(yz, v), dot(zx, v), dot(xy, v)});
}

/// Fraction of these changes of spin that turns neither body by more than `angle` (rad) in a substep of h seconds.
template <class L>
FATHOM_LANE_FUNCTION L turning_share(VecOf<L> by_a, VecOf<L> by_b, L h, float angle) {
  const L most = splat<L>(angle * angle), fastest = larger(dot(by_a, by_a), dot(by_b, by_b));
  return root(most / larger(h * h * fastest, most));
}

/// The two bodies of a joint during one sweep. `Bodies` has sides `a` and `b` (linear, angular, moved, turned,
/// inverse_inertia), `inverse_of_a()` and `inverse_of_b()` (dynamics/inverse_inertia-inl.hpp), and flags for whether
/// all are isotropic and A is never pushed.
template <class L, class Bodies>
struct BallJointSweep {
  Bodies& bodies;
  JointArm<L, Bodies::all_isotropic> at_a, at_b;
  VecOf<L> spun_a, spun_b;  ///< rad/s that the row's impulse has contributed by the end of `carry_along`

  FATHOM_LANE_FUNCTION BallJointSweep(const BallJointRow<L>& row, Bodies& of)
      : bodies(of), at_a(of.a, row.arm_a), at_b(of.b, row.arm_b) {
    spun_a = spun_b = zero_vector<L>();
  }

  FATHOM_LANE_FUNCTION VecOf<L> velocity() const {
    return (bodies.b.linear + cross(at_b.in_world(bodies.b.angular), at_b.arm)) -
           (bodies.a.linear + cross(at_a.in_world(bodies.a.angular), at_a.arm));
  }
  /// Speed (m/s) at which anchors separate in a step of h seconds beyond their relative velocity: arms turn, so anchors
  /// move on circles, and a step along the tangent ends outside. Call it after `carry_along`. Where the last substep's
  /// impulse, along arms that have turned since, spins a light body more than the sweep will leave it, only a part of
  /// that spin counts.
  FATHOM_LANE_FUNCTION VecOf<L> drift(L h) const {
    const L less = turning_share(spun_a, spun_b, h, max_carry) - splat<L>(1.0f);
    return drift_of(at_b.in_world(mul_add(bodies.b.angular, less, spun_b)), at_b.arm, h) -
           drift_of(at_a.in_world(mul_add(bodies.a.angular, less, spun_a)), at_a.arm, h);
  }
  FATHOM_LANE_FUNCTION VecOf<L> gap(const BallJointRow<L>& row) const {
    return row.gap + ((bodies.b.moved + (at_b.arm - row.arm_b)) - (bodies.a.moved + (at_a.arm - row.arm_a)));
  }
  /// Fraction of this impulse that turns neither body by more than `max_drift` in a substep of h seconds. A larger one
  /// would throw the anchors past each other.
  FATHOM_LANE_FUNCTION L followed_share(VecOf<L> impulse, L h) const {
    const VecOf<L> by_b = spun_b_by(impulse, at_b.moment_of(impulse));
    if constexpr (Bodies::only_pushes_b)
      return turning_share(by_b, by_b, h, max_drift);
    else
      return turning_share(spun_a_by(impulse, at_a.moment_of(impulse)), by_b, h, max_drift);
  }
  /// Adds to the row's impulse and applies the addition.
  FATHOM_LANE_FUNCTION void push(BallJointRow<L>& row, VecOf<L> impulse) {
    push(bodies.b, at_b, bodies.inverse_of_b(), impulse, row.moment_b);
    if constexpr (!Bodies::only_pushes_b)
      push(bodies.a, at_a, bodies.inverse_of_a(), negated<L>(impulse), row.moment_a);
  }
  /// Re-applies the impulse so far at the current arms, but only as much as does not fling the bodies around: an
  /// impulse that went along a thin rod one substep ago now spins the rod about its own axis.
  FATHOM_LANE_FUNCTION void carry_along(BallJointRow<L>& row, L h) {
    const VecOf<L> impulse = row.impulse, was_b = spun_b_by(impulse, row.moment_b), moment_b = at_b.moment_of(impulse);
    spun_b = spun_b_by(impulse, moment_b);
    const VecOf<L> reverse = negated<L>(impulse);
    VecOf<L> was_a = spun_a, moment_a = spun_a;
    if constexpr (!Bodies::only_pushes_b) {
      was_a = spun_a_by(reverse, row.moment_a), moment_a = at_a.moment_of(reverse);
      spun_a = spun_a_by(reverse, moment_a);
    }
    const L share = turning_share(spun_a - was_a, spun_b - was_b, h, max_drift), less = share - splat<L>(1.0f);
    const auto carry = [&](auto& side, const auto& at, const auto& inertia, VecOf<L> acting, VecOf<L> moment,
                           VecOf<L> was, VecOf<L>& now, VecOf<L>& noted) FATHOM_LANE_LAMBDA {
      moment = scale(share, moment), now = scale(share, now);
      side.linear = at.frame.moved(side.linear, inertia, scale(less, acting), moment - noted);
      side.angular = side.angular + (now - was);
      noted = moment;
    };
    carry(bodies.b, at_b, bodies.inverse_of_b(), impulse, moment_b, was_b, spun_b, row.moment_b);
    if constexpr (!Bodies::only_pushes_b)
      carry(bodies.a, at_a, bodies.inverse_of_a(), reverse, moment_a, was_a, spun_a, row.moment_a);
    row.impulse = scale(share, impulse);
  }
  /// Mean response to an impulse (1/kg).
  FATHOM_LANE_FUNCTION L response() const {
    const L one = splat<L>(1.0f), zero = splat<L>(0.0f);
    return splat<L>(1.0f / 3) *
           (response({one, zero, zero}).x + (response({zero, one, zero}).y + response({zero, zero, one}).z));
  }
  /// The impulse that changes the anchors' relative velocity by `change`, less `compliance` times itself.
  FATHOM_LANE_FUNCTION VecOf<L> impulse_for(VecOf<L> change, L compliance) const {
    const L one = splat<L>(1.0f), zero = splat<L>(0.0f);
    VecOf<L> x = response({one, zero, zero}), y = response({zero, one, zero}), z = response({zero, zero, one});
    x.x = x.x + compliance, y.y = y.y + compliance, z.z = z.z + compliance;
    return solved<L>(x, y, z, change);
  }

 private:
  /// To second order, for turns up to `max_drift`: beyond that an anchor comes back on its circle.
  FATHOM_LANE_FUNCTION static VecOf<L> drift_of(VecOf<L> spin, VecOf<L> arm, L h) {
    const L most = splat<L>(max_drift * max_drift), turned = h * h * dot(spin, spin);
    return scale(splat<L>(0.5f) * h * (most / larger(turned, most)), cross(spin, cross(spin, arm)));
  }
  template <class Side, class Arm, class Inertia>
  FATHOM_LANE_FUNCTION static void push(Side& side, const Arm& at, const Inertia& inertia, VecOf<L> impulse,
                                        VecOf<L>& noted) {
    const VecOf<L> moment = at.moment_of(impulse);
    at.frame.push(side, inertia, impulse, moment);
    noted = noted + moment;
  }
  FATHOM_LANE_FUNCTION VecOf<L> spun_b_by(VecOf<L> impulse, VecOf<L> moment) const {
    return at_b.frame.spun_by(bodies.inverse_of_b(), impulse, moment);
  }
  FATHOM_LANE_FUNCTION VecOf<L> spun_a_by(VecOf<L> impulse, VecOf<L> moment) const {
    return at_a.frame.spun_by(bodies.inverse_of_a(), impulse, moment);
  }
  FATHOM_LANE_FUNCTION VecOf<L> response(VecOf<L> impulse) const {
    const VecOf<L> of_b = at_b.response(impulse, bodies.inverse_of_b());
    if constexpr (Bodies::only_pushes_b)
      return of_b;
    else
      return of_b + at_a.response(impulse, bodies.inverse_of_a());
  }
};

/// Applies the last step's impulse.
template <class L, class Bodies>
FATHOM_LANE_FUNCTION void warm_start_ball_joint(BallJointRow<L>& row, Bodies& bodies) {
  BallJointSweep<L, Bodies>(row, bodies).push(row, row.impulse);
}

/// The pull that closes a joint's gap (m/s); for a rigid joint at most `max_pull`.
template <class L>
FATHOM_LANE_FUNCTION VecOf<L> limited_pull(const BallJointRow<L>& row, VecOf<L> pull) {
  const L one = splat<L>(1.0f), most = splat<L>(max_pull * max_pull);
  const L shrink = root(most / larger(dot(pull, pull), most));
  return scale(mul_add(one, row.rigid, shrink - one), pull);
}

/// Compliance with which the relax sweep settles a spring (see `settling_spring`) where an impulse changes the
/// velocity across it by `response`. Finite for the softest spring.
template <class L>
FATHOM_LANE_FUNCTION L settling_compliance(L compliance, L response) {
  const L ratio = smaller(compliance / larger(response, splat<L>(1e-30f)), splat<L>(1e6f));
  return splat<L>(settling_spring) * ratio * (ratio * response);
}

/// The part of the row's wanted impulse beyond its maximum.
template <class L>
FATHOM_LANE_FUNCTION VecOf<L> beyond_most(const BallJointRow<L>& row, VecOf<L> impulse) {
  const L size = root(dot(impulse, impulse)), zero = splat<L>(0.0f);
  const auto is_beyond = both(is_above(size, row.most), is_above(row.most, zero));
  return scale(select(is_beyond, splat<L>(1.0f) - row.most / size, zero), impulse);
}

/// 1 where a joint pushes both of its bodies: springs between them are tamed (see `stiffest_spring`).
template <class L, class Bodies>
FATHOM_LANE_FUNCTION L pushes_both(const Bodies& bodies) {
  if constexpr (Bodies::only_pushes_b)
    return splat<L>(0.0f);
  else
    return is_less(splat<L>(0.0f), bodies.a.inverse_mass);
}

/// One sweep of a substep of h seconds. Returns a sum that is finite only where all results are.
template <JointPass pass, class L, class Bodies>
FATHOM_LANE_FUNCTION L solve_ball_joint(BallJointRow<L>& row, Bodies& bodies, L h, bool ends_substep) {
  BallJointSweep<L, Bodies> sweep(row, bodies);
  if constexpr (pass != JointPass::relax) sweep.carry_along(row, h);
  VecOf<L> wanted = sweep.velocity();
  const L zero = splat<L>(0.0f), one = splat<L>(1.0f);
  const L tame = (one - row.rigid) * pushes_both<L>(bodies);
  L compliance = row.compliance;
  if constexpr (pass != JointPass::relax) {
    L bias = row.bias_rate;
    if (any_above(tame, zero)) {
      compliance = choose(tame, larger(compliance, splat<L>(1 / stiffest_spring) * sweep.response()), compliance);
      bias = choose(tame, smaller(bias, splat<L>(closing_of_spring) / h), bias);
    }
    wanted = mul_add(wanted + sweep.drift(h), splat<L>(-0.5f) * h, row.pull);
    wanted = wanted + limited_pull(row, scale(bias, sweep.gap(row)));
    wanted = mul_add(wanted, compliance, row.impulse);
  }
  if constexpr (pass == JointPass::relax)
    if (any_above(tame, zero)) compliance = choose(tame, settling_compliance(compliance, sweep.response()), compliance);
  VecOf<L> change = sweep.impulse_for(wanted, compliance);
  if constexpr (pass == JointPass::relax)
    change = scale(zero - larger(row.rigid, tame), change);
  else
    change = mul_add(scale(zero - row.mass_scale, change), zero - row.impulse_scale, row.impulse);
  if (any_above(row.most, zero)) change = change - beyond_most(row, row.impulse + change);
  change = scale(sweep.followed_share(change, h), change);
  row.impulse = row.impulse + change;
  if (ends_substep) row.total = row.total + row.impulse;
  sweep.push(row, change);
  const VecOf<L> sum = (bodies.a.linear + bodies.a.angular) + (bodies.b.linear + bodies.b.angular) + row.impulse;
  return sum.x + (sum.y + sum.z);
}

/// Sets arms, gap and starting impulse, without a pull, for bodies with orientations `q_a` and `q_b`; `between` leads
/// from A's centre to B's (m).
template <class L>
FATHOM_LANE_FUNCTION void prepare_ball_joint(const UnitQuat<L>& q_a, const UnitQuat<L>& q_b, VecOf<L> between,
                                             VecOf<L> anchor_a, VecOf<L> anchor_b, VecOf<L> impulse,
                                             BallJointRow<L>& row) {
  row.arm_a = turned_by(q_a, anchor_a);
  row.arm_b = turned_by(q_b, anchor_b);
  row.gap = between + (row.arm_b - row.arm_a);
  row.impulse = impulse;
  const L zero = splat<L>(0.0f);
  row.total = row.moment_a = row.moment_b = row.pull = {zero, zero, zero};
}
