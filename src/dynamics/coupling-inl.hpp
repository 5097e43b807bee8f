// The row of a coupling over a lane type L, like those of generic joints (dynamics/generic_joint-inl.hpp), which are
// included first.
//
// One row: share_a x_a + share_b x_b stays within bounds, where x is each body's angle about an axis, travel along an
// axis or distance from a point, all fixed in the world. Angles count whole turns separately from the remainder: the
// sum keeps its precision however far the wheels have turned.

/// The motion of one body that the coupling ties.
template <class L>
struct CoupledEnd {
  UnitQuat<L> from;  ///< world frame; the motion is along or about its axis x
  L turns, rope;     ///< 1 for an angle, 1 for a distance; both 0: travel along the axis
  L share;
};
inline constexpr int coupled_field_count = 7;

/// A coupling's two ends.
template <class L>
struct CoupledEnds {
  CoupledEnd<L> a, b;
  L tells_a;  ///< 1: the reported reaction is that on A
};

/// An angle with its whole turns.
template <class L>
struct CountedAngle {
  L turns, angle;  ///< whole turns, and within one (rad)
};

/// State of a coupling that outlasts a sweep. Frames, arms and ways are those at the start of the step.
template <class L>
struct CouplingRow {
  UnitQuat<L> frame_a, frame_b;  ///< the joint's frames in the world
  VecOf<L> arm_a, arm_b;         ///< m, from the centres of mass to the anchors
  VecOf<L> way_a, way_b;         ///< m, from the ends' fixed points to the anchors
  CountedAngle<L> start_a, start_b;
  CoupledEnds<L> coupling;
  L bias_rate, mass_scale, impulse_scale;
  L rigid, compliance;  ///< 1, or 0 for a spring; its compliance (1/kg or 1/(kg·m²))
  L lower, upper, limited;

  L impulse;  ///< on the row's sum, over the substep
  CountedAngle<L> angle_a, angle_b;
  VecOf<L> given_a, given_b;    ///< N·s, total so far on each body
  VecOf<L> moment_a, moment_b;  ///< N·m·s, about its centre, in the axes of its spin
  VecOf<L> force, torque;       ///< N·s and N·m·s over the step, at the reported end
};

/// Rounds to the nearest integer; |a| below 4 million.
template <class L>
FATHOM_LANE_FUNCTION L rounded(L a) {
  const L shift = splat<L>(12582912.0f);
  return (a + shift) - shift;
}

/// How far a body's end has moved.
template <class L>
struct CoupledPosition {
  VecOf<L> push, moment;  ///< effect of a unit impulse on the body: N·s and N·m·s, world axes
  CountedAngle<L> value;  ///< for a travel or distance: no turns, and m
  VecOf<L> way, arm;      ///< m
  L length;               ///< m, of `way`

  FATHOM_LANE_FUNCTION CoupledPosition(const CoupledEnd<L>& end, const UnitQuat<L>& frame, VecOf<L> arm_at_start,
                                       VecOf<L> way_at_start, const CountedAngle<L>& start, VecOf<L> moved,
                                       VecOf<L> turned) {
    const L zero = splat<L>(0.0f), one = splat<L>(1.0f), two_pi = splat<L>(6.28318531f);
    const UnitQuat<L> rotation = rotation_by<L>(turned), q = product(conjugate(end.from), product(rotation, frame));
    const VecOf<L> ahead{one, zero, zero}, axis = turned_by(end.from, ahead), x = turned_by(q, ahead);
    arm = turned_by(rotation, arm_at_start);
    way = way_at_start + (moved + (arm - arm_at_start));
    length = root(dot(way, way));
    const VecOf<L> line = scale(inverse_or_zero(length), way);
    push = chosen(end.rope, line, axis);
    const L sign = choose(is_less(q.w, zero), splat<L>(-1.0f), one);
    const L half = angle_of(sign * q.v.x, sign * q.w), angle = half + half;
    const L bisector = one / larger(one + x.x, splat<L>(0.01f));
    const VecOf<L> about = turned_by(end.from, VecOf<L>{one, x.y * bisector, x.z * bisector});
    moment = chosen(end.turns, about, cross(arm, push));
    const L turns = start.turns + rounded((start.angle + (dot(turned, axis) - angle)) / two_pi);
    value.turns = choose(end.turns, turns, zero);
    value.angle = choose(end.turns, angle, choose(end.rope, length, dot(axis, way)));
    push = scale(one - end.turns, push);
  }

 private:
  FATHOM_LANE_FUNCTION static VecOf<L> chosen(L condition, VecOf<L> a, VecOf<L> b) {
    return {choose(condition, a.x, b.x), choose(condition, a.y, b.y), choose(condition, a.z, b.z)};
  }
};

/// One end as a sweep sees it.
template <class L, bool all_isotropic>
struct CoupledSide {
  CoupledPosition<L> at;
  SpinFrame<L, all_isotropic> frame;
  VecOf<L> turn;  ///< `at.moment` in the axes of the spin
  L drift;        ///< m/s by which a substep changes it beyond its rate

  template <class Side>
  FATHOM_LANE_FUNCTION CoupledSide(const CoupledEnd<L>& end, const UnitQuat<L>& start_frame, VecOf<L> arm, VecOf<L> way,
                                   const CountedAngle<L>& start, const Side& side, L h)
      : at(end, start_frame, arm, way, start, side.moved, side.turned), frame(rotation_by<L>(side.turned), side) {
    const VecOf<L> omega = frame.in_world(side.angular);
    turn = frame.from_world(at.moment);
    // As in a distance joint: arms turn, and so do lines.
    const L most = splat<L>(max_drift * max_drift), half = splat<L>(0.5f) * h, turned = h * h * dot(omega, omega);
    const VecOf<L> curve = scale(most / larger(turned, most), cross(omega, cross(omega, at.arm)));
    const VecOf<L> apart = side.linear + cross(omega, at.arm);
    const L inverse = inverse_or_zero(at.length);
    const VecOf<L> across = cross(scale(h * inverse, at.way), apart);
    const L swept = smaller(dot(across, across) * inverse * inverse, most);
    drift = half * dot(at.push, curve) + splat<L>(0.5f) * end.rope * swept * at.length * inverse_or_zero(h);
  }
  /// Change of the motion's rate per unit impulse.
  template <class Inertia>
  FATHOM_LANE_FUNCTION L response(const Inertia& inertia) const {
    const L spun = dot(turn, frame.spun_by(inertia, at.push, turn));
    if constexpr (Inertia::couples)
      return spun + dot(at.push, frame.moved_by(inertia, at.push, turn));
    else
      return mul_add(spun, inertia.mass, dot(at.push, at.push));
  }
  /// Applies a row impulse to the body, less the part already applied.
  template <class Side, class Inertia>
  FATHOM_LANE_FUNCTION void push(Side& side, const Inertia& inertia, L impulse, VecOf<L> less, VecOf<L> less_moment,
                                 VecOf<L>& given, VecOf<L>& moment) const {
    const VecOf<L> linear = scale(impulse, at.push) - less, turning = scale(impulse, turn) - less_moment;
    frame.push(side, inertia, linear, turning);
    given = given + linear, moment = moment + turning;
  }
};

template <class L, class Bodies>
struct CouplingSweep {
  static constexpr bool only_pushes_b = Bodies::only_pushes_b;

  Bodies& bodies;
  const CoupledEnds<L>& coupling;
  CoupledSide<L, Bodies::all_isotropic> a, b;

  FATHOM_LANE_FUNCTION CouplingSweep(const CouplingRow<L>& row, Bodies& of, L h)
      : bodies(of),
        coupling(row.coupling),
        a(row.coupling.a, row.frame_a, row.arm_a, row.way_a, row.start_a, of.a, h),
        b(row.coupling.b, row.frame_b, row.arm_b, row.way_b, row.start_b, of.b, h) {}

  /// Whole turns are summed separately.
  FATHOM_LANE_FUNCTION L value() const {
    const L turns = mul_add(coupling.a.share * a.at.value.turns, coupling.b.share, b.at.value.turns);
    const L angles = mul_add(coupling.a.share * a.at.value.angle, coupling.b.share, b.at.value.angle);
    return mul_add(angles, splat<L>(6.28318531f), turns);
  }
  FATHOM_LANE_FUNCTION L velocity() const {
    const L of_a = dot(a.at.push, bodies.a.linear) + dot(a.turn, bodies.a.angular);
    return coupling.a.share * of_a +
           coupling.b.share * (dot(b.at.push, bodies.b.linear) + dot(b.turn, bodies.b.angular));
  }
  FATHOM_LANE_FUNCTION L drift() const { return coupling.a.share * a.drift + coupling.b.share * b.drift; }
  FATHOM_LANE_FUNCTION L response() const {
    L sum = coupling.b.share * coupling.b.share * b.response(bodies.inverse_of_b());
    if constexpr (!only_pushes_b) sum = sum + coupling.a.share * coupling.a.share * a.response(bodies.inverse_of_a());
    return sum;
  }
  /// Adds to the row's impulse.
  FATHOM_LANE_FUNCTION void push(CouplingRow<L>& row, L impulse) {
    const VecOf<L> none = zero_vector<L>();
    push(row, impulse, none, none, none, none);
  }
  /// Re-applies the impulse so far along the current lines.
  FATHOM_LANE_FUNCTION void carry_along(CouplingRow<L>& row) {
    push(row, row.impulse, row.given_a, row.given_b, row.moment_a, row.moment_b);
  }
  FATHOM_LANE_FUNCTION void add_up(CouplingRow<L>& row) const {
    const L one = splat<L>(1.0f), tells_b = one - coupling.tells_a;
    const L of_a = coupling.tells_a * coupling.a.share * row.impulse, of_b = tells_b * coupling.b.share * row.impulse;
    row.force = row.force + (scale(of_a, a.at.push) + scale(of_b, b.at.push));
    const VecOf<L> moment_a = scale(of_a * coupling.a.turns, a.at.moment);
    row.torque = row.torque + (moment_a + scale(of_b * coupling.b.turns, b.at.moment));
  }

 private:
  /// Less the part already applied.
  FATHOM_LANE_FUNCTION void push(CouplingRow<L>& row, L impulse, VecOf<L> given_a, VecOf<L> given_b, VecOf<L> moment_a,
                                 VecOf<L> moment_b) {
    b.push(bodies.b, bodies.inverse_of_b(), coupling.b.share * impulse, given_b, moment_b, row.given_b, row.moment_b);
    if constexpr (!only_pushes_b)
      a.push(bodies.a, bodies.inverse_of_a(), coupling.a.share * impulse, given_a, moment_a, row.given_a, row.moment_a);
  }
};

/// Applies the last step's impulse.
template <class L, class Bodies>
FATHOM_LANE_FUNCTION void warm_start_coupling(CouplingRow<L>& row, Bodies& bodies) {
  CouplingSweep<L, Bodies>(row, bodies, splat<L>(0.0f)).carry_along(row);
}

/// The row's impulse after a sweep before positions move: that of a locked row, or what a bound asks for.
template <class L, class Sweep>
FATHOM_LANE_FUNCTION L soft_coupling_impulse(const CouplingRow<L>& row, const Sweep& sweep, L h, L inverse) {
  const L zero = splat<L>(0.0f);
  const L value = sweep.value(), speed = sweep.velocity() + sweep.drift();
  const L most = choose(row.rigid, splat<L>(max_pull), splat<L>(3e37f));
  const L pull = bounded(row.bias_rate * (value - row.lower), most);
  const L gain = inverse / mul_add(splat<L>(1.0f), row.compliance, inverse);  // `inverse` itself without compliance
  const L wanted = mul_add(speed + pull, row.compliance, row.impulse);
  const L held = mul_add(row.impulse, zero - row.mass_scale * gain, wanted);
  const L locked = held - row.impulse_scale * row.impulse;
  // Without the bound's impulse so far.
  const L free_speed = speed - row.impulse * inverse_or_zero(inverse);
  const L at = mul_add(value, h, free_speed), below = is_less(at, row.lower), above = is_less(row.upper, at);
  const L bound = bounded((choose(below, row.lower, row.upper) - value) / h, splat<L>(max_pull));
  const L change = (bound - speed) * inverse, lasts = is_less(zero, larger(row.impulse, zero - row.impulse));
  const L soft = mul_add(row.mass_scale * change, zero - row.impulse_scale, row.impulse);
  const L pressing = row.impulse + choose(lasts, soft, change);
  const L one_way = choose(below, larger(pressing, zero), smaller(pressing, zero));
  return choose(row.limited, larger(below, above) * one_way, locked);
}

/// One sweep of a substep of h seconds, like `solve_ball_joint`.
template <JointPass pass, class L, class Bodies>
FATHOM_LANE_FUNCTION L solve_coupling(CouplingRow<L>& row, Bodies& bodies, L h, bool ends_substep) {
  CouplingSweep<L, Bodies> sweep(row, bodies, h);
  const L zero = splat<L>(0.0f);
  if constexpr (pass != JointPass::relax) sweep.carry_along(row);
  const L inverse = inverse_or_zero(sweep.response());
  L impulse = row.impulse;
  if constexpr (pass == JointPass::relax) {
    const L held = row.impulse - sweep.velocity() * inverse;
    const L pressing = choose(is_less(row.impulse, zero), smaller(held, zero), larger(held, zero));
    const L presses = is_less(zero, larger(row.impulse, zero - row.impulse));
    impulse = choose(row.limited, presses * pressing, choose(row.rigid, held, row.impulse));
  } else {
    impulse = soft_coupling_impulse(row, sweep, h, inverse);
  }
  sweep.push(row, impulse - row.impulse);
  row.impulse = impulse;
  row.angle_a = sweep.a.at.value, row.angle_b = sweep.b.at.value;
  if (ends_substep) sweep.add_up(row);
  const VecOf<L> sum = (bodies.a.linear + bodies.a.angular) + (bodies.b.linear + bodies.b.angular) + row.given_b;
  return sum.x + (sum.y + (sum.z + row.impulse));
}

/// Sets frames, arms and ways for bodies at these orientations and positions; `on_a` and `on_b` are the joint frames on
/// them.
template <class L>
FATHOM_LANE_FUNCTION void prepare_coupling(const UnitQuat<L>& q_a, const UnitQuat<L>& q_b, VecOf<L> position_a,
                                           VecOf<L> position_b, const UnitQuat<L>& on_a, const UnitQuat<L>& on_b,
                                           VecOf<L> anchor_a, VecOf<L> anchor_b, VecOf<L> from_a, VecOf<L> from_b,
                                           CouplingRow<L>& row) {
  row.frame_a = product(q_a, on_a), row.frame_b = product(q_b, on_b);
  row.arm_a = turned_by(q_a, anchor_a), row.arm_b = turned_by(q_b, anchor_b);
  row.way_a = (position_a - from_a) + row.arm_a, row.way_b = (position_b - from_b) + row.arm_b;
  const L zero = splat<L>(0.0f);
  row.given_a = row.given_b = row.moment_a = row.moment_b = row.force = row.torque = {zero, zero, zero};
}

/// The angle with which an end begins a step; `last` is that at the end of the step before.
template <class L>
FATHOM_LANE_FUNCTION CountedAngle<L> resumed(const CoupledEnd<L>& end, const UnitQuat<L>& frame, VecOf<L> arm,
                                             VecOf<L> way, const CountedAngle<L>& last) {
  const L zero = splat<L>(0.0f);
  const VecOf<L> still{zero, zero, zero};
  return CoupledPosition<L>(end, frame, arm, way, last, still, still).value;
}
