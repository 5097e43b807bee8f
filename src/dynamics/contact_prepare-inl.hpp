// Builds the rows of a contact from its manifold, over a lane type L; included after dynamics/contact-inl.hpp.
//
// `Manifold` reads one: VecOf<L> normal(), tangent() (world axes); VecOf<L> on_a(i), on_b(i), position of point i on
// each body, from A's centre (m, world axes); VecOf<L> between(), from A's centre to B's; L impulse(i); L friction();
// FrictionImpulse<L> friction_impulse(); int end(); bool has(i); a mask used(i); move_arms(normal, load, bodies, arm_a,
// arm_b), which calls `move_arms_midway` for round contacts. `Rows` has set_frame(ContactAxesOf<L>), set_response,
// set_friction, set_point and set_friction_impulse.

/// The response K over (n, t1, t2) to impulses at c.
template <class L, class Bodies>
FATHOM_LANE_FUNCTION ContactResponse<L> contact_response(const ContactAxesOf<L>& axes, const Bodies& bodies) {
  const auto& a = bodies.inverse_of_a();
  const auto& b = bodies.inverse_of_b();
  const VecOf<L> la = a.spun_by(axes.n, axes.lever_a), lb = b.spun_by(axes.n, axes.lever_b), turned = la + lb;
  const VecOf<L> turn_1 = spun_apart(bodies, axes.t1), turn_2 = spun_apart(bodies, axes.t2);
  ContactResponse<L> k;
  k.nn =
      (a.along(axes.n, axes.lever_a) + b.along(axes.n, axes.lever_b)) + (dot(axes.lever_a, la) + dot(axes.lever_b, lb));
  k.n1 = dot(axes.t1, turned);
  k.n2 = dot(axes.t2, turned);
  k.k11 = dot(axes.t1, turn_1);
  k.k12 = dot(axes.t2, turn_1);
  k.k22 = dot(axes.t2, turn_2);
  return k;
}

/// Effective mass (kg) of a point at (x, y).
template <class L>
FATHOM_LANE_FUNCTION L mass_at(const ContactResponse<L>& k, L x, L y) {
  const L h_n = mul_sub(mul_add(k.nn, y, k.n1), x, k.n2);
  const L h_1 = mul_sub(mul_add(k.n1, y, k.k11), x, k.k12);
  const L h_2 = mul_sub(mul_add(k.n2, y, k.k12), x, k.k22);
  return inverse_or_zero(mul_sub(mul_add(h_n, y, h_1), x, h_2));
}

/// Effective masses of sliding at c and of twisting about the normal. `impulse` and `load`: those of friction and of
/// the points in the last substep.
///
/// The inverse of the tangential matrix K stops both directions at once. But an impulse that is then cut to its limit
/// points along K⁻¹ v, not against the sliding velocity v: a long box that slides at an angle to its axes would curve.
/// Projected impulses settle against v if both directions have the same mass, and at all if that is no more than the
/// smaller one. So a patch that slides, whose friction is near its limit, gets this mass.
template <class L, class Bodies>
FATHOM_LANE_FUNCTION void set_friction_masses(const ContactAxesOf<L>& axes, const Bodies& bodies,
                                              const FrictionImpulse<L>& impulse, L load, ContactFriction<L>& row) {
  const VecOf<L> a1 = cross(axes.arm_a, axes.t1), a2 = cross(axes.arm_a, axes.t2);
  const VecOf<L> b1 = cross(axes.arm_b, axes.t1), b2 = cross(axes.arm_b, axes.t2);
  const auto& a = bodies.inverse_of_a();
  const auto& b = bodies.inverse_of_b();
  const VecOf<L> ia1 = a.spun_by(axes.t1, a1), ib1 = b.spun_by(axes.t1, b1);
  const VecOf<L> ia2 = a.spun_by(axes.t2, a2), ib2 = b.spun_by(axes.t2, b2);
  const L s11 = (a.along(axes.t1, a1) + b.along(axes.t1, b1)) + (dot(a1, ia1) + dot(b1, ib1));
  const L s22 = (a.along(axes.t2, a2) + b.along(axes.t2, b2)) + (dot(a2, ia2) + dot(b2, ib2));
  L s12 = dot(a2, ia1) + dot(b2, ib1);
  if constexpr (std::remove_cvref_t<decltype(a)>::couples || std::remove_cvref_t<decltype(b)>::couples)
    s12 = s12 + dot(axes.t2, a.moved_by(axes.t1, a1) + b.moved_by(axes.t1, b1));
  const L inverse_det = inverse_or_zero(mul_sub(s11 * s22, s12, s12));
  row.slide_11 = s22 * inverse_det;
  row.slide_12 = splat<L>(0.0f) - s12 * inverse_det;
  row.slide_22 = s11 * inverse_det;
  const L limit = splat<L>(slides_at) * row.coefficient * load, most = limit * limit;
  const L squared = mul_add(impulse.slide_2 * impulse.slide_2, impulse.slide_1, impulse.slide_1);
  if (any_above(squared, most)) {
    const auto slides = is_above(squared, most);
    const L half = splat<L>(0.5f), mean = half * (s11 + s22), off = half * (s11 - s22);
    const L smaller_mass = inverse_or_zero(mean + root(mul_add(s12 * s12, off, off)));
    row.slide_11 = select(slides, smaller_mass, row.slide_11);
    row.slide_12 = select(slides, splat<L>(0.0f), row.slide_12);
    row.slide_22 = select(slides, smaller_mass, row.slide_22);
  }
  row.twist_mass = inverse_or_zero(dot(axes.n, spun_apart(bodies, axes.n)));
}

/// The shapes of a contact of which one is round, with the radii R_a and R_b.
template <class L>
struct RoundContact {
  L half_step;  ///< s, half a step; 0: its arms stay
  L substeps;   ///< in a step
  L curvature;  ///< m, R_a R_b / (R_a + R_b), or the radius of the only round body
  L share_a;    ///< R_a / (R_a + R_b); 1 where only B is round, 0 where only A is
};

/// Moves the arms of a round contact to where they will be in the middle of the step. Forces act along them for the
/// whole step. Along those of its beginning they lag behind by half of it, and what rocks or hangs gains energy: a ring
/// on a peg swings up by itself, as with any explicit rule for an oscillator. The arm to the core of a round shape, a
/// capsule's axis or a ball's centre, turns with the body; the rest, R n, keeps its direction. c moves with the cores,
/// and along a body that is not round with the core of the other.
///
/// Only what hangs needs this: a body whose load pushes the core back over its centre as it turns. A load that presses
/// it over, as on most bodies of a heap, gains from the lag: it damps.
///
/// The present spin tells where the arm will be only if it lasts for a step. So arms move by no more than a quarter of
/// themselves, and c by no more than a quarter of both radii. And a load N that makes the body swing by itself with the
/// angular frequency ω, ω² = N |core| / I, turns its spin about within a step Δt where ω Δt > 1; arms then move less.
/// `load` is N over a substep (N·s), `gap` the separation (m), `motion` has sides with linear, angular and
/// inverse_mass.
template <class L, class Motion, class Bodies>
FATHOM_LANE_FUNCTION void move_arms_midway(const RoundContact<L>& round, L load, L gap, const Motion& motion,
                                           const Bodies& bodies, VecOf<L> n, VecOf<L>& arm_a, VecOf<L>& arm_b) {
  const L zero = splat<L>(0.0f), one = splat<L>(1.0f), four = splat<L>(4.0f), least = splat<L>(1e-6f);
  const L h = round.half_step, share_b = one - round.share_a;
  // From c, the middle of gap or overlap, to the cores.
  const L half_gap = splat<L>(0.5f) * gap;
  const L to_a = select(is_above(share_b, zero), round.curvature / larger(share_b, least) + half_gap, zero);
  const L to_b = select(is_above(round.share_a, zero), round.curvature / larger(round.share_a, least) + half_gap, zero);
  const auto &a = motion.a, &b = motion.b;
  const VecOf<L> core_a = mul_sub(arm_a, to_a, n), core_b = mul_add(arm_b, to_b, n);
  const VecOf<L> along_a = cross(a.angular, core_a), along_b = cross(b.angular, core_b);
  const VecOf<L> apart = (b.linear + along_b) - (a.linear + along_a), slip = mul_sub(apart, dot(n, apart), n);
  const L push = splat<L>(2.0f) * (h * round.substeps) * load;  // Δt² N
  // How long an arm turns; `up` points to where the load pushes the body.
  const auto time = [&](VecOf<L> spin, VecOf<L> core, L radius, VecOf<L> up) FATHOM_LANE_LAMBDA {
    const L squared = dot(spin, spin), response = dot(spin, spun_apart(bodies, spin));
    const L arm = root(dot(core, core)), swing = push * arm * (response / larger(squared, splat<L>(1e-12f)));
    // What is round about its own centre has no core to hang on, except by rounding.
    const L lift = squared * dot(core, up) - dot(spin, core) * dot(spin, up);
    const auto hangs = is_above(lift, splat<L>(min_hang) * squared * (arm + radius));
    return select(hangs, h / mul_add(mul_add(one, four, h * h * squared), swing, swing), zero);
  };
  const L reach = larger(to_a + to_b, least);
  const L slides = one / mul_add(one, four, h * h * dot(slip, slip) / (reach * reach));
  const L moves_a = select(is_above(a.inverse_mass, zero), one, zero);
  const L time_a = moves_a * time(a.angular, core_a, to_a, scale(splat<L>(-1.0f), n)),
          time_b = time(b.angular, core_b, to_b, n);
  arm_a = mul_add(arm_a, time_a, mul_add(along_a, round.share_a * slides, slip));
  arm_b = mul_add(arm_b, time_b, mul_sub(along_b, share_b * slides, slip));
}

/// Sets frame, points and starting impulses; `overlap` (m) of the depth counts as touching. Returns the nearest points'
/// separation (m), with the overlap added.
template <class L, class Manifold, class Rows, class Bodies>
FATHOM_LANE_FUNCTION L prepare_contact_rows(const Manifold& m, L overlap, const Bodies& bodies, Rows& rows) {
  const L zero = splat<L>(0.0f), one = splat<L>(1.0f);
  const VecOf<L> normal = m.normal();
  VecOf<L> middle[max_manifold_points];
  L separation[max_manifold_points], weight[max_manifold_points];
  L nearest = splat<L>(1e30f);
  for (int i = 0; i < m.end(); ++i) {
    if (!m.has(i)) continue;
    const VecOf<L> on_a = m.on_a(i), on_b = m.on_b(i);
    separation[i] = dot(on_b - on_a, normal) + overlap;
    rows.set_impulse(i, select(m.used(i), m.impulse(i), zero));
    middle[i] = scale(splat<L>(0.5f), on_a + on_b);
    nearest = select(m.used(i), smaller(nearest, separation[i]), nearest);
  }
  // c is the centre of the last step's load or, without one, of the points that touch or nearly do.
  L near_count = zero, load = zero;
  const L reach = nearest + splat<L>(friction_reach);
  for (int i = 0; i < m.end(); ++i) {
    if (!m.has(i)) continue;
    weight[i] = select(m.used(i), select(is_above(separation[i], reach), zero, one), zero);
    near_count = near_count + weight[i];
    load = mul_add(load, weight[i], m.impulse(i));
  }
  const auto loaded = is_above(load, splat<L>(1e-30f));
  const L share = one / select(loaded, load, larger(near_count, one));
  VecOf<L> c{zero, zero, zero};
  L gap = zero - overlap;
  for (int i = 0; i < m.end(); ++i) {
    if (!m.has(i)) continue;
    weight[i] = weight[i] * share * select(loaded, m.impulse(i), one);
    c = mul_add(c, weight[i], middle[i]);
    gap = mul_add(gap, weight[i], separation[i]);
  }
  VecOf<L> arm_a = c, arm_b = c - m.between();
  m.move_arms(normal, load, gap, bodies, arm_a, arm_b);
  const ContactAxesOf<L> axes(normal, m.tangent(), arm_a, arm_b);
  const ContactResponse<L> response = contact_response(axes, bodies);
  L radius_sum = zero;
  for (int i = 0; i < m.end(); ++i) {
    if (!m.has(i)) continue;
    const VecOf<L> from_c = middle[i] - c;
    const L x = select(m.used(i), dot(from_c, axes.t1), zero), y = select(m.used(i), dot(from_c, axes.t2), zero);
    rows.set_point(i, {x, y, separation[i], select(m.used(i), mass_at(response, x, y), zero)});
    radius_sum = mul_add(radius_sum, weight[i], root(mul_add(y * y, x, x)));
  }
  ContactFriction<L> friction;
  friction.coefficient = m.friction();
  friction.patch_radius = splat<L>(patch_share) * radius_sum;
  const FrictionImpulse<L> last = m.friction_impulse();
  set_friction_masses(axes, bodies, last, load, friction);
  rows.set_frame(axes);
  rows.set_response(response);
  rows.set_friction(friction);
  rows.set_friction_impulse(last);
  return nearest;
}
