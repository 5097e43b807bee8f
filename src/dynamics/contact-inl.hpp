// The rows of a contact and the sweeps over them, over a lane type L: `float`, or a vector register that holds one
// contact per lane. Included like the joint laws (dynamics/ball_joint-inl.hpp).
//
// A manifold's points share one normal, so their rows are written about one reference point c in the frame
// (t1, t2, n): with u the relative velocity of the bodies at c and ω the relative angular velocity, a point at (x, y)
// in that frame approaches with
//     vn = u·n + y (ω·t1) − x (ω·t2),
// two numbers per point instead of two anchors. Point impulses act on the three numbers (u·n, ω·t1, ω·t2) through a
// symmetric 3×3 matrix K, and only their sum (P along n, torques T1, T2) is applied to the bodies. Applied to the
// bodies' movement since the step began, the same rows give the separation in later substeps (to first order in the
// rotation of a step; exact for a sphere, since its contact stays under the centre).
//
// Order within a sweep (Box2D v3, Box3D `contact_solver.c`): the soft sweep solves penetration alone; the relax sweep
// solves the points without bias, then friction, whose limit is by then the impulse that carries the load.
//
// `Rows` accesses one contact's data, wherever it is stored:
//     ContactAxesOf<L> axes();  ContactResponse<L> response();  ContactFriction<L> friction();
//     int end();  bool has(i);  ContactPoint<L> point(i);  L impulse(i);  void set_impulse(i, L);
//     FrictionImpulse<L> friction_impulse();  void set_friction_impulse(FrictionImpulse<L>);
//     bool may_bounce();  L restitution();  L pull();
// `Bodies` has sides `a` and `b` (linear, angular, moved, turned), `inverse_of_a()` and `inverse_of_b()`
// (dynamics/inverse_inertia-inl.hpp), and a flag for whether A is never pushed.

enum class ContactPass {
  soft,     ///< before positions move, with bias and push-out
  relax,    ///< after they move, without either
  iterate,  ///< a plain velocity bias, in the `impulse` solver
};

/// `a`, clamped to ±`most`.
template <class L>
FATHOM_LANE_FUNCTION L within(L a, L most) {
  return larger(splat<L>(0.0f) - most, smaller(a, most));
}

/// (n·u, t1·ω, t2·ω) of velocities or movements.
template <class L>
struct NormalMotionOf {
  L n, t1, t2;

  FATHOM_LANE_FUNCTION L at(L x, L y) const { return mul_sub(mul_add(n, y, t1), x, t2); }
};

/// K over (n, t1, t2).
template <class L>
struct ContactResponse {
  L nn, n1, n2, k11, k12, k22;
};

template <class L>
struct ContactFriction {
  L coefficient;   ///< Coulomb's
  L patch_radius;  ///< lever of the twist limit: `patch_share` times the points' load-weighted mean distance from c (m)
  L slide_11, slide_12, slide_22;  ///< inverse of the 2×2 matrix of sliding at c (kg)
  L twist_mass;                    ///< kg·m²
};

/// Data that all points of a contact share.
template <class L>
struct ContactFrameOf {
  VecOf<L> normal;   ///< unit, world axes, from A to B
  VecOf<L> tangent;  ///< unit, perpendicular to the normal
  VecOf<L> arm_a;    ///< from A's centre to c (m)
  VecOf<L> arm_b;    ///< from B's centre to c (m)
  ContactResponse<L> response;
  ContactFriction<L> friction;
};

template <class L>
struct ContactPoint {
  L x, y;        ///< along t1 and t2, from c (m)
  L separation;  ///< m, when the step began
  L mass;        ///< effective mass (kg)
};

/// Friction impulse, accumulated over a substep.
template <class L>
struct FrictionImpulse {
  L slide_1, slide_2;  ///< N·s along t1 and t2 = n × t1
  L twist;             ///< N·m·s about the normal
};

/// The contact frame as sweeps use it.
template <class L>
struct ContactAxesOf {
  VecOf<L> n, t1, t2, arm_a, arm_b, lever_a, lever_b;

  ContactAxesOf() = default;
  FATHOM_LANE_FUNCTION ContactAxesOf(VecOf<L> normal, VecOf<L> tangent, VecOf<L> on_a, VecOf<L> on_b)
      : n(normal),
        t1(tangent),
        t2(cross(normal, tangent)),
        arm_a(on_a),
        arm_b(on_b),
        lever_a(cross(on_a, normal)),
        lever_b(cross(on_b, normal)) {}
  FATHOM_LANE_FUNCTION explicit ContactAxesOf(const ContactFrameOf<L>& f)
      : ContactAxesOf(f.normal, f.tangent, f.arm_a, f.arm_b) {}

  FATHOM_LANE_FUNCTION NormalMotionOf<L> motion(VecOf<L> linear_a, VecOf<L> angular_a, VecOf<L> linear_b,
                                                VecOf<L> angular_b) const {
    const VecOf<L> spin = angular_b - angular_a;
    return {dot(n, linear_b - linear_a) + (dot(lever_b, angular_b) - dot(lever_a, angular_a)), dot(t1, spin),
            dot(t2, spin)};
  }
  /// Relative velocity of the bodies.
  template <class Bodies>
  FATHOM_LANE_FUNCTION NormalMotionOf<L> velocity(const Bodies& bodies) const {
    return motion(bodies.a.linear, bodies.a.angular, bodies.b.linear, bodies.b.angular);
  }
  /// Relative movement since the step began.
  template <class Bodies>
  FATHOM_LANE_FUNCTION NormalMotionOf<L> movement(const Bodies& bodies) const {
    return motion(bodies.a.moved, bodies.a.turned, bodies.b.moved, bodies.b.turned);
  }
};

template <class L, class Bodies>
FATHOM_LANE_FUNCTION void push_normal(Bodies& bodies, const ContactAxesOf<L>& f, const NormalMotionOf<L>& sum) {
  const VecOf<L> torque = mul_add(scale(sum.t1, f.t1), sum.t2, f.t2);
  push_apart(bodies, scale(sum.n, f.n), mul_add(torque, sum.n, f.lever_a), mul_add(torque, sum.n, f.lever_b));
}

template <class L, class Bodies>
FATHOM_LANE_FUNCTION void push_tangential(Bodies& bodies, const ContactAxesOf<L>& f,
                                          const FrictionImpulse<L>& impulse) {
  const VecOf<L> slide = mul_add(scale(impulse.slide_1, f.t1), impulse.slide_2, f.t2);
  const VecOf<L> torque = scale(impulse.twist, f.n);
  push_apart(bodies, slide, torque + cross(f.arm_a, slide), torque + cross(f.arm_b, slide));
}

template <class L, class Rows>
FATHOM_LANE_FUNCTION L total_impulse(const Rows& rows) {
  L sum = rows.impulse(0);
  for (int i = 1; i < rows.end(); ++i) sum = sum + rows.impulse(i);
  return sum;
}

/// Applies the impulses of the last step (Catto, "Iterative Dynamics with Temporal Coherence", 2005).
template <class L, class Rows, class Bodies>
FATHOM_LANE_FUNCTION void warm_start_contact(const Rows& rows, Bodies& bodies) {
  const ContactAxesOf<L> axes = rows.axes();
  const L zero = splat<L>(0.0f);
  NormalMotionOf<L> sum{zero, zero, zero};
  for (int i = 0; i < rows.end(); ++i) {
    if (!rows.has(i)) continue;
    const L impulse = rows.impulse(i);
    const ContactPoint<L> p = rows.point(i);
    sum.n = sum.n + impulse;
    sum.t1 = mul_add(sum.t1, p.y, impulse);
    sum.t2 = mul_sub(sum.t2, p.x, impulse);
  }
  push_normal(bodies, axes, sum);
  push_tangential(bodies, axes, rows.friction_impulse());
}

/// Accumulates the points' impulses of one sweep and carries their effect on the relative motion.
template <class L>
struct NormalSweep {
  ContactResponse<L> k;
  NormalMotionOf<L> motion, sum;

  FATHOM_LANE_FUNCTION NormalSweep(const ContactResponse<L>& response, const NormalMotionOf<L>& velocity)
      : k(response), motion(velocity) {
    sum.n = sum.t1 = sum.t2 = splat<L>(0.0f);
  }
  FATHOM_LANE_FUNCTION void add(L impulse, L x, L y) {
    const L torque_1 = y * impulse, torque_2 = splat<L>(0.0f) - x * impulse;
    sum.n = sum.n + impulse;
    sum.t1 = sum.t1 + torque_1;
    sum.t2 = sum.t2 + torque_2;
    motion.n = mul_add(mul_add(mul_add(motion.n, k.nn, impulse), k.n1, torque_1), k.n2, torque_2);
    motion.t1 = mul_add(mul_add(mul_add(motion.t1, k.n1, impulse), k.k11, torque_1), k.k12, torque_2);
    motion.t2 = mul_add(mul_add(mul_add(motion.t2, k.n2, impulse), k.k12, torque_1), k.k22, torque_2);
  }
};

/// Parameters of a sweep over the points.
template <class L>
struct ContactStepOf {
  L inverse_substep;  ///< 1/s
  L bias_rate, mass_scale, impulse_scale;
  L push_out_velocity;  ///< m/s
  L slop;               ///< m within which points count as just touching (`support_slop`)
};

/// Stiffens the softness of a contact of which the fraction `held` (0 to 1) is held directly. Springs that yield under
/// load damp the sway of stacks that only sweeps hold; a direct solution leaves no sway, so nothing needs to yield.
template <class L>
FATHOM_LANE_FUNCTION void stiffen(L held, ContactStepOf<L>& step) {
  const L one = splat<L>(1.0f), soft = one - held, rate = splat<L>(support_push_out_rate);
  const auto is_held = is_above(held, splat<L>(0.0f));
  step.bias_rate = select(is_held, mul_add(rate, soft, step.bias_rate - rate), step.bias_rate);
  step.mass_scale = select(is_held, mul_add(one, soft, step.mass_scale - one), step.mass_scale);
  step.impulse_scale = select(is_held, soft * step.impulse_scale, step.impulse_scale);
}

/// Separation or penetration (m) up to which the bodies of a held contact count as just touching: each of its points
/// then keeps the impulse that the direct solution gave it. `patch_radius` is the contact's (m).
template <class L>
FATHOM_LANE_FUNCTION L support_slop(L patch_radius) {
  return smaller(splat<L>(max_support_slop), splat<L>(patch_radius_slop) * patch_radius);
}

/// Between two movable bodies, one more than eight times as heavy as the other, a contact gives back half as much of
/// its impulse: the light body's spring carries the heavy one's weight and would yield too far.
template <class L>
FATHOM_LANE_FUNCTION void stiffen_uneven(L inverse_mass_a, L inverse_mass_b, ContactStepOf<L>& step) {
  const L least = smaller(inverse_mass_a, inverse_mass_b), most = larger(inverse_mass_a, inverse_mass_b);
  const auto is_uneven = both(is_above(least, splat<L>(0.0f)), is_above(most, splat<L>(uneven_ratio) * least));
  step.impulse_scale = select(is_uneven, splat<L>(uneven_share) * step.impulse_scale, step.impulse_scale);
}

/// Changes the impulses of a contact's points by equal shares that stop their mean motion, where its bodies meet or
/// part faster than `landing_speed`. The sweep that follows would give most of an impact to the first point, and take
/// an impulse that is no longer needed from it first: a body that lands flat would start to turn, and friction would
/// throw it on (docs/solver.md, Free bodies and bouncing).
template <ContactPass pass, bool held, class L, class Rows>
FATHOM_LANE_FUNCTION void share_impact(Rows& rows, const NormalMotionOf<L>& moved, const ContactStepOf<L>& step,
                                       NormalSweep<L>& sweep) {
  const L zero = splat<L>(0.0f), one = splat<L>(1.0f);
  const auto& k = sweep.k;
  L takes_part[max_manifold_points], speeds = zero, count = zero, sum_x = zero, sum_y = zero;
  for (int i = 0; i < rows.end(); ++i) {
    if (!rows.has(i)) continue;
    const ContactPoint<L> p = rows.point(i);
    L separation = p.separation + moved.at(p.x, p.y);
    if constexpr (held) separation = separation - within(separation, step.slop);
    const L speed = mul_add(sweep.motion.at(p.x, p.y), larger(separation, zero), step.inverse_substep);
    L meets = select(both(is_above(zero, speed), is_above(p.mass, zero)), one, zero);
    if (pass == ContactPass::relax && rows.may_bounce())  // see `solve_points`
      meets = select(both(is_above(separation, zero), is_above(rows.restitution(), zero)), zero, meets);
    takes_part[i] = select(is_above(rows.impulse(i), zero), one, meets);
    speeds = mul_add(speeds, takes_part[i], speed);
    count = count + takes_part[i];
    sum_x = mul_add(sum_x, takes_part[i], p.x), sum_y = mul_add(sum_y, takes_part[i], p.y);
  }
  const auto is_shared = both(is_above(count, one), is_above(magnitude(sweep.motion.n), splat<L>(landing_speed)));
  // Of the points' speeds to equal impulses.
  const L of_n = mul_sub(mul_add(k.nn * count, k.n1, sum_y), k.n2, sum_x);
  const L of_1 = mul_sub(mul_add(k.n1 * count, k.k11, sum_y), k.k12, sum_x);
  const L of_2 = mul_sub(mul_add(k.n2 * count, k.k12, sum_y), k.k22, sum_x);
  const L response = mul_sub(mul_add(count * of_n, sum_y, of_1), sum_x, of_2);
  const L share = select(is_shared, (zero - speeds) / select(is_shared, response, one), zero);
  if (!any_above(magnitude(share), zero)) return;
  for (int i = 0; i < rows.end(); ++i) {
    if (!rows.has(i)) continue;
    const L old = rows.impulse(i), part = takes_part[i] * share;
    const L now = select(is_above(magnitude(part), zero), larger(old + part, zero), old);
    rows.set_impulse(i, now);
    const ContactPoint<L> p = rows.point(i);
    sweep.add(now - old, p.x, p.y);
  }
}

/// One sweep over the points; `held`: some may be within the step's slop. Returns the bodies' approach velocity
/// afterwards, which is finite only if their velocities and the impulses are.
template <ContactPass pass, bool held, class L, class Rows, class Bodies>
FATHOM_LANE_FUNCTION L solve_points(Rows& rows, const ContactAxesOf<L>& axes, Bodies& bodies,
                                    const ContactStepOf<L>& step) {
  const L zero = splat<L>(0.0f);
  NormalSweep<L> sweep(rows.response(), axes.velocity(bodies));
  const NormalMotionOf<L> moved = axes.movement(bodies);
  if constexpr (pass != ContactPass::iterate)
    if (any_above(magnitude(sweep.motion.n), splat<L>(landing_speed)))
      share_impact<pass, held>(rows, moved, step, sweep);
  for (int i = 0; i < rows.end(); ++i) {
    if (!rows.has(i)) continue;
    const ContactPoint<L> p = rows.point(i);
    const L old = rows.impulse(i);
    L separation = p.separation + moved.at(p.x, p.y);
    if constexpr (held) separation = separation - within(separation, step.slop);
    const L speed = sweep.motion.at(p.x, p.y);
    const auto apart = is_above(separation, zero);
    // Speculative contact: a point that is still apart may close its gap within the substep, but no more.
    const L gap_speed = separation * step.inverse_substep;
    L bias = larger(gap_speed, zero), mass = p.mass, kept = old;
    if constexpr (pass != ContactPass::relax) bias = select(apart, gap_speed, step.bias_rate * separation);
    if constexpr (pass == ContactPass::soft) {
      mass = mass * select(apart, splat<L>(1.0f), step.mass_scale);
      kept = mul_sub(old, select(apart, zero, step.impulse_scale), old);
    }
    L impulse = mul_sub(kept, mass, speed + bias);
    // The limit applies to the velocity that this sweep adds. Impulses that carry a lasting load are exempt, or bodies
    // under a larger load would keep sinking into each other. Bodies that spring back are not exempt, or everything
    // that a fall has compressed would rebound.
    if constexpr (pass != ContactPass::relax) {
      const L carried = select(is_above(speed, splat<L>(pressed_speed)), kept, old);
      impulse = smaller(impulse, mul_sub(carried, mass, speed - step.push_out_velocity));
    }
    impulse = larger(impulse, zero);
    // A point that will bounce keeps its speed until it meets the surface: the relax sweep must not brake it in the
    // air.
    if (pass == ContactPass::relax && rows.may_bounce())
      impulse = select(both(apart, is_above(rows.restitution(), zero)), smaller(impulse, old), impulse);
    rows.set_impulse(i, impulse);
    sweep.add(impulse - old, p.x, p.y);
  }
  push_normal(bodies, axes, sweep.sum);
  return sweep.motion.n;
}

/// Speed, to second order, that turning by the rotation vector `turned` adds to the end of an arm (m) on a body that
/// spins with `angular`.
template <class L>
FATHOM_LANE_FUNCTION VecOf<L> carried_speed(VecOf<L> arm, VecOf<L> turned, VecOf<L> angular) {
  const VecOf<L> along = cross(turned, arm);
  return cross(angular, mul_add(along, splat<L>(0.5f), cross(turned, along)));
}

/// Addition to the sliding velocity at c where A is kinematic, due to the movement of the patch so far plus `lead` (s)
/// (`friction_lead`). A body that rests on a turning one has to follow the circle within the step: along a tangent it
/// would drift outwards by (ω Δt)² / 2 times its radius in every step. The patch moves with B's centre and turns about
/// it with A. B's own spin does not carry it: the patch stays below the centre of a ball that rolls on A.
template <class L, class Bodies>
FATHOM_LANE_FUNCTION VecOf<L> carried_slide(const Bodies& bodies, const ContactAxesOf<L>& axes, L lead) {
  const auto &a = bodies.a, &b = bodies.b;
  const VecOf<L> moved = mul_add(b.moved - a.moved, lead, b.linear - a.linear);
  const VecOf<L> turned = mul_add(a.turned, lead, a.angular);
  return carried_speed<L>(axes.arm_b, turned, b.angular - a.angular) - cross(a.angular, moved);
}

/// Limits sliding impulses to an ellipse: the nearest impulse to `wanted` within it. Its semi-axes are
/// `most` (N·s) along (grain_1, grain_2) in the plane of t1 and t2, and 1 − |grain| of that across. The nearest impulse
/// makes friction oppose the ellipse's normal, as maximum dissipation demands (Moreau, "On unilateral constraints,
/// friction and plasticity", 1974): a ski that drifts at an angle is braked across its axis almost alone. Newton's
/// method on the reciprocal of the scaled length (Moré and Sorensen, "Computing a trust region step", 1983, section 3)
/// comes within 0.005 of the semi-axes in five rounds, or 0.05 where they are more than 20 times apart; the result
/// is in the ellipse in any case.
template <class L>
FATHOM_LANE_FUNCTION FrictionImpulse<L> limited_to_ellipse(L grain_1, L grain_2, L most,
                                                           const FrictionImpulse<L>& wanted) {
  const L zero = splat<L>(0.0f), one = splat<L>(1.0f), least = splat<L>(1e-30f);
  const L grain = root(mul_add(grain_2 * grain_2, grain_1, grain_1));
  const L inverse = inverse_or_zero(grain);
  const L cosine = select(is_above(grain, zero), grain_1 * inverse, one), sine = grain_2 * inverse;
  const L ratio = larger(one - grain, zero), ratio_squared = ratio * ratio;
  const L along = mul_add(cosine * wanted.slide_1, sine, wanted.slide_2),
          across = mul_sub(cosine * wanted.slide_2, sine, wanted.slide_1);
  // In units of `most`, but no more than a million of them, whose squares are finite.
  const L unit = larger(larger(most, splat<L>(1e-6f) * larger(magnitude(along), magnitude(across))), least);
  const L u = along / unit, v = across / unit;
  L lambda = larger(larger(magnitude(u) - one, ratio * (magnitude(v) - ratio)), zero);
  L x = zero, y = zero, squared = zero;
  for (int round = 0; round < 5; ++round) {
    const L p = one + lambda, q = larger(ratio_squared + lambda, least);
    x = u / p, y = ratio * v / q;
    squared = mul_add(y * y, x, x);
    const L slope = larger(mul_add(y * y / q, x, x / p), least);
    lambda = larger(mul_add(lambda, root(squared) - one, squared / slope), lambda);
  }
  const L kept = most / larger(root(squared), one);
  const L now_along = x * kept, now_across = ratio * y * kept;
  return {mul_sub(cosine * now_along, sine, now_across), mul_add(cosine * now_across, sine, now_along), wanted.twist};
}

/// Friction over the patch around c; returns the updated impulse. Stops first the twist about the normal, then the
/// sliding, each within its own limit: µ times `load`, the sum of the points' impulses, and for the twist times the
/// patch radius R. Over a patch that slides with v and spins with ω, friction points along the local slip: where R ω is
/// much larger than v, only v / √(v² + R² ω²) of it is left for sliding. Without that factor a spinning box stops
/// wherever its load's centre happens to be, which rocks it and moves the load. v counts as at least what friction
/// stops in a substep, so a gripped body keeps its whole limit. A common limit would be closer to Coulomb's law, but
/// loses grips where opposite twists of two contacts use it up (docs/log/2026-11-23-friction-patches.md). `carried`
/// adds to the sliding velocity the motion of moving surfaces and, where A is kinematic, `carried_slide`. Where
/// friction depends on direction it has `limits_by_direction()` and `limited(most, wanted, otherwise)`, see
/// `limited_to_ellipse`.
template <class L, class Bodies, class Carried>
FATHOM_LANE_FUNCTION FrictionImpulse<L> solve_friction(const ContactFriction<L>& row, const ContactAxesOf<L>& axes,
                                                       Bodies& bodies, L load, const FrictionImpulse<L>& old,
                                                       const Carried& carried) {
  const L limit = row.coefficient * load, least = splat<L>(1e-37f);
  const L twist_speed = dot(axes.n, bodies.b.angular - bodies.a.angular);
  const L twist = within(mul_sub(old.twist, row.twist_mass, twist_speed), limit * row.patch_radius);
  // The twist's effect on sliding at c comes through the bodies' velocities, which are updated first.
  twist_apart(bodies, scale(twist - old.twist, axes.n));
  const VecOf<L> slip = carried((bodies.b.linear + cross(bodies.b.angular, axes.arm_b)) -
                                (bodies.a.linear + cross(bodies.a.angular, axes.arm_a)));
  const L v1 = dot(axes.t1, slip), v2 = dot(axes.t2, slip);
  const L wanted_1 = old.slide_1 - mul_add(row.slide_12 * v2, row.slide_11, v1);
  const L wanted_2 = old.slide_2 - mul_add(row.slide_22 * v2, row.slide_12, v1);
  // The masses of oblong bodies that hardly turn are unbounded, and get squared.
  const L mass = smaller(splat<L>(0.5f) * (row.slide_11 + row.slide_22), splat<L>(1e12f));
  const L spin = mass * row.patch_radius * twist_speed;
  const L slide = mul_add(limit * limit, mass * mass, mul_add(v2 * v2, v1, v1));
  const L max_squared = limit * limit * (slide / larger(mul_add(slide, spin, spin), least));
  const L squared = mul_add(wanted_2 * wanted_2, wanted_1, wanted_1);
  // Without load there is no friction, even where the square underflows.
  const L zero = splat<L>(0.0f), one = splat<L>(1.0f);
  const L beyond = select(is_above(squared, max_squared), root(max_squared / larger(squared, least)), one);
  const L kept = select(is_above(limit, zero), beyond, zero);
  FrictionImpulse<L> now{wanted_1 * kept, wanted_2 * kept, twist};
  if constexpr (requires { carried.limits_by_direction(); })
    if (carried.limits_by_direction())
      now = carried.limited(root(max_squared), FrictionImpulse<L>{wanted_1, wanted_2, twist}, now);
  push_tangential(bodies, axes, FrictionImpulse<L>{now.slide_1 - old.slide_1, now.slide_2 - old.slide_2, zero});
  return now;
}

/// The same within a sweep, with the impulses accumulated in the rows. Returns their sum, which is finite only if all
/// are.
template <class L, class Rows, class Bodies, class Carried>
FATHOM_LANE_FUNCTION L sweep_friction(Rows& rows, const ContactAxesOf<L>& axes, Bodies& bodies,
                                      const Carried& carried) {
  const FrictionImpulse<L> now =
      solve_friction(rows.friction(), axes, bodies, total_impulse<L>(rows), rows.friction_impulse(), carried);
  rows.set_friction_impulse(now);
  return now.twist + (now.slide_1 + now.slide_2);
}

/// Result of a bounce.
template <class L>
struct Bounce {
  bool any;   ///< whether any lane bounced; if not, nothing has changed
  L impulse;  ///< N·s along the normal
  L sum;      ///< finite only if all results are
};

/// Separation speed (m/s) of two points that approach with the relative speed `speed` < 0 under the relative
/// acceleration `pull` (m/s²) and, if nothing else happens, meet within a substep of length h. Seen from their current
/// positions, they part with e times the speed at which they would meet. Points that bounce before they meet thus keep
/// their energy to the last bit, wherever in the substep they meet: a body that falls through the gap gains v² − 2 a s
/// before it bounces; without that, every bounce would lose m g times the gap. Negative: they do not meet, or more
/// slowly than `threshold`.
template <class L>
FATHOM_LANE_FUNCTION L leaving_speed(L speed, L separation, L e, L pull, L h, L threshold) {
  const L zero = splat<L>(0.0f), no = splat<L>(-1.0f);
  const auto misses = is_above(mul_add(separation, h, mul_add(speed, h, pull)), zero);
  const L gap = larger(separation, zero);
  const L squared = mul_add(speed * speed, splat<L>(-2.0f) * pull, gap);
  const L meeting = select(is_above(zero, speed), zero - root(larger(squared, zero)), speed);
  const L e_meeting = e * meeting;
  const L left = mul_add(e_meeting * e_meeting, splat<L>(2.0f) * pull, gap);
  const L leaving = select(is_above(zero - threshold, meeting), root(larger(left, zero)), no);
  return select(misses, no, leaving);
}

/// Points that would meet within the substep of `h` seconds, faster than `threshold` (m/s), leave at once with e times
/// that speed: Newton's law, before velocities are integrated, one contact after the other. `surfaces` adds the motion
/// of moving surfaces to the sliding velocity.
template <class L, class Rows, class Bodies, class Surfaces>
FATHOM_LANE_FUNCTION Bounce<L> bounce_contact(Rows& rows, Bodies& bodies, L h, L threshold, const Surfaces& surfaces) {
  const L zero = splat<L>(0.0f), one = splat<L>(1.0f);
  const ContactAxesOf<L> axes = rows.axes();
  NormalSweep<L> sweep(rows.response(), axes.velocity(bodies));
  const NormalMotionOf<L> moved = axes.movement(bodies);
  const L e = rows.restitution(), pull = rows.pull();
  L leaving[max_manifold_points], hit[max_manifold_points];
  L bounced = zero;
  for (int i = 0; i < rows.end(); ++i) {
    leaving[i] = splat<L>(-1.0f), hit[i] = zero;
    if (!rows.has(i)) continue;
    const ContactPoint<L> p = rows.point(i);
    const L separation = p.separation + moved.at(p.x, p.y);
    const L speed = leaving_speed(sweep.motion.at(p.x, p.y), separation, e, pull, h, threshold);
    leaving[i] = select(both(is_above(e, zero), is_above(p.mass, zero)), speed, leaving[i]);
    bounced = bounced + select(is_above(zero, leaving[i]), zero, one);
  }
  if (!any_above(bounced, zero)) return {false, zero, zero};
  // Several points at once: start with equal shares, or a body that falls flat would not rise flat.
  const auto several = is_above(bounced, one);
  const L share = one / select(several, sweep.k.nn * bounced, one);
  for (int i = 0; i < rows.end(); ++i) {
    if (!rows.has(i)) continue;
    const ContactPoint<L> p = rows.point(i);
    const L first = select(several, share, p.mass) * (leaving[i] - sweep.motion.at(p.x, p.y));
    hit[i] = select(is_above(zero, leaving[i]), zero, first);
  }
  for (int i = 0; i < rows.end(); ++i)
    if (rows.has(i)) sweep.add(hit[i], rows.point(i).x, rows.point(i).y);
  for (int round = 0; any_above(bounced, one) && round < bounce_rounds; ++round)
    for (int i = 0; i < rows.end(); ++i) {
      if (!rows.has(i)) continue;
      const ContactPoint<L> p = rows.point(i);
      const L wanted = larger(mul_add(hit[i], p.mass, leaving[i] - sweep.motion.at(p.x, p.y)), zero);
      const L impulse = select(several, select(is_above(zero, leaving[i]), hit[i], wanted), hit[i]);
      sweep.add(impulse - hit[i], p.x, p.y);
      hit[i] = impulse;
    }
  push_normal(bodies, axes, sweep.sum);
  const FrictionImpulse<L> slid =
      solve_friction(rows.friction(), axes, bodies, sweep.sum.n, FrictionImpulse<L>{zero, zero, zero}, surfaces);
  return {true, sweep.sum.n, (sweep.motion.n + slid.twist) + (slid.slide_1 + slid.slide_2)};
}
