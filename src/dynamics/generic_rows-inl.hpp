// The rows of a generic or distance joint over a lane type L, like those of ball joints (dynamics/ball_joint-inl.hpp),
// which is included first. They are solved in dynamics/generic_joint-inl.hpp.
//
// Six axes: three translations of B's anchor in A's frame, the twist about B's axis x and its two swings. The relative
// rotation is decomposed into a swing of axis x and the remaining twist, whose rate is that about the bisector of the
// two axes x; both hold for any swing below pi. Where one swing is locked at zero, the twist is that about B's axis x,
// whatever the swing. Translations act on both bodies at B's anchor: a slider that is far out then conserves angular
// momentum.

inline constexpr int axis_count = 6, translations = 3;

/// Parameters of an axis for a substep, which `generic_axis` makes from a definition. An axis that is neither locked
/// nor limited is free.
template <class L>
struct GenericAxis {
  L locked, limited;  ///< 1 or 0
  L lower, upper;     ///< m or rad; for a locked axis both are the held position
  /// A drive wants the velocity approach (target - x) + velocity - compliance · impulse.
  L target, approach, velocity, compliance;
  L most;  ///< N·s or N·m·s; 0: no drive
  L restitution;
  L armature;  ///< kg or kg·m²
};
inline constexpr int axis_field_count = 11;

/// Where one joint was at the start of the step, and what its axes allow.
template <class L>
struct GenericJointPlace {
  UnitQuat<L> frame_a, frame_b;  ///< the joint's frames in the world
  VecOf<L> arm_a, arm_b;         ///< m, from the centres of mass, world axes
  VecOf<L> gap;                  ///< m, from A's anchor to B's
  VecOf<L> pull;                 ///< m/s², see BallJointRow
  L distance;                    ///< 1 for a distance joint
  L cone;                        ///< 1 where a cone limits the swing instead of two axes
  L is_soft;                     ///< 1 where what would be locked is a spring
  L min_hit;                     ///< m/s or rad/s, above which limits throw back
  GenericAxis<L> axes[axis_count];
};

/// Which axes a joint has, in the form that its rows read. If one of the bodies cannot be pushed, it is A.
template <class L>
struct GenericJointDefinition {
  UnitQuat<L> on_a{splat<L>(1), {}}, on_b{splat<L>(1), {}};  ///< the joint's frames on the bodies
  L distance{}, cone{}, is_soft{};                           ///< see GenericJointPlace
  L moves{};                                                 ///< 1: some axis has a limit, a drive or an armature
  L reacts{};                                                ///< 1: an armature or restitution
  L min_hit{};                                               ///< m/s or rad/s, speed above which limits bounce
  GenericAxis<L> axes[axis_count] = {};
};

/// Impulses that outlast a step, on B, in the order of the axes.
template <class L>
struct GenericImpulseOf {
  L hold[axis_count] = {}, drive[axis_count] = {};  ///< N·s and N·m·s of the last substep, for warm starting
  VecOf<L> force, torque;                           ///< N·s and N·m·s of the whole step, world axes
};

/// State of one joint that outlasts a sweep.
template <class L>
struct GenericJointRow : GenericJointPlace<L> {
  L bias_rate, mass_scale, impulse_scale;  ///< of locked axes

  L hold[axis_count];           ///< N·s or N·m·s on B over the substep, of locked axes and limits
  L drive[axis_count];          ///< the same, of drives
  VecOf<L> given;               ///< N·s on B, sum of all so far
  VecOf<L> moment_a, moment_b;  ///< N·m·s, its moments about the centres, in the axes of the spins; A gets the reverse
  VecOf<L> force, torque;       ///< N·s and N·m·s on B over the step, world axes

  // For joints that move (see JointUse): impulse and moments, as in `given`, with which the last sweep pulled axes back
  // inside their limits. The next sweep removes them.
  VecOf<L> pulled, pulled_a, pulled_b;

  // For joints that react to speeds.
  L bounce[axis_count];  ///< m/s or rad/s at which the substep leaves a limit that was hit
  L rate[axis_count];    ///< after the last sweep
};

/// Optional features of a joint's axes, or of any of several joints side by side.
struct JointUse {
  bool moves = false;   ///< limits or drives
  bool reacts = false;  ///< armature or restitution
};

template <class L>
FATHOM_LANE_FUNCTION UnitQuat<L> product(const UnitQuat<L>& p, const UnitQuat<L>& q) {
  return {p.w * q.w - dot(p.v, q.v), scale(p.w, q.v) + (scale(q.w, p.v) + cross(p.v, q.v))};
}
template <class L>
FATHOM_LANE_FUNCTION UnitQuat<L> conjugate(const UnitQuat<L>& q) {
  return {q.w, scale(splat<L>(-1.0f), q.v)};
}

/// `a`, clamped to ±`most`.
template <class L>
FATHOM_LANE_FUNCTION L bounded(L a, L most) {
  return smaller(larger(a, splat<L>(0.0f) - most), most);
}

/// The six current rows of a joint: positions and directions.
template <class L, class Bodies>
struct GenericJointRows {
  static constexpr bool only_pushes_b = Bodies::only_pushes_b;
  using Frame = SpinFrame<L, Bodies::all_isotropic>;

  Bodies& bodies;
  Frame frame_a, frame_b;                                 ///< in which spins are expressed
  VecOf<L> along[translations];                           ///< unit vectors in the world
  VecOf<L> turn_of_a[axis_count], turn_of_b[axis_count];  ///< m or 1: moment of a unit impulse, in the axes of the spin
  VecOf<L> spin_of_a[axis_count], spin_of_b[axis_count];  ///< and the spin that it gives
  L value[axis_count];                                    ///< m or rad
  L drift[axis_count];  ///< m/s or rad/s by which a substep changes it beyond its rate

  /// Sets positions only: `along`, `value`, `reach`, `arm`, `torque_axis`.
  FATHOM_LANE_FUNCTION GenericJointRows(const GenericJointPlace<L>& row, Bodies& of)
      : GenericJointRows(row, of, rotation_by<L>(of.a.turned), rotation_by<L>(of.b.turned)) {}
  /// The same for bodies that have turned by these rotations since the step began.
  FATHOM_LANE_FUNCTION GenericJointRows(const GenericJointPlace<L>& row, Bodies& of, const UnitQuat<L>& turned_a,
                                        const UnitQuat<L>& turned_b)
      : bodies(of), frame_a(turned_a, of.a), frame_b(turned_b, of.b) {
    arm_a_ = turned_by(turned_a, row.arm_a), arm_ = turned_by(turned_b, row.arm_b);
    gap_ = row.gap + ((bodies.b.moved + (arm_ - row.arm_b)) - (bodies.a.moved + (arm_a_ - row.arm_a)));
    set_positions(row, product(turned_a, row.frame_a), turned_b, gap_);
    reach_ = arm_a_ + slide_of(row, gap_);
    spun_a_ = spun_b_ = zero_vector<L>();
  }
  FATHOM_LANE_FUNCTION GenericJointRows(const GenericJointRow<L>& row, Bodies& of, L h) : GenericJointRows(row, of) {
    // Velocities without the last substep's impulses: these act again along arms that have turned since, and give light
    // bodies spins that the sweep will correct.
    spun_b_ = frame_b.spun_by(of.inverse_of_b(), row.given, row.moment_b);
    const VecOf<L> omega_b = frame_b.in_world(of.b.angular - spun_b_);
    const VecOf<L> linear_b =
        frame_b.moved(of.b.linear, of.inverse_of_b(), negated<L>(row.given), negated<L>(row.moment_b));
    VecOf<L> omega_a = frame_a.in_world(of.a.angular), linear_a = of.a.linear;
    if constexpr (!only_pushes_b) {
      spun_a_ = frame_a.spun_by(of.inverse_of_a(), row.given, row.moment_a);
      omega_a = frame_a.in_world(of.a.angular + spun_a_);
      linear_a = frame_a.moved(of.a.linear, of.inverse_of_a(), row.given, row.moment_a);
    }
    const VecOf<L> speed_b = linear_b + cross(omega_b, arm_);
    set_drift(row, gap_, speed_b - (linear_a + cross(omega_a, arm_a_)), h);
    const VecOf<L> apart = speed_b - (linear_a + cross(omega_a, reach_));  // as seen from A
    const L slides = splat<L>(1.0f) - row.distance;
    VecOf<L> curve = curve_of(omega_b, arm_, h) - curve_of(omega_a, mul_add(arm_a_, slides, reach_ - arm_a_), h);
    const VecOf<L> slow_a = followed(omega_a, h), relative = followed(omega_b, h) - slow_a;
    curve = curve - scale(slides * h, cross(slow_a, apart));
    for (int i = 0; i < translations; ++i) {
      set_turns(i, along[i], cross(reach_, along[i]), cross(arm_, along[i]));
      set_turns(translations + i, zero_vector<L>(), about_[i], about_[i]);
      drift[i] = drift[i] + dot(along[i], curve) - splat<L>(0.5f) * h * dot(along[i], row.pull);
      drift[translations + i] = splat<L>(0.5f) * h * dot(cross(slow_a, about_[i]), relative);
    }
  }

  /// m, from A's and from B's centre to the point where the joint acts, and the rotation axes, all in the world.
  FATHOM_LANE_FUNCTION VecOf<L> reach() const { return reach_; }
  FATHOM_LANE_FUNCTION VecOf<L> arm() const { return arm_; }
  FATHOM_LANE_FUNCTION VecOf<L> torque_axis(int i) const { return about_[i]; }
  FATHOM_LANE_FUNCTION L velocity(int i) const {
    const L turning = dot(turn_of_b[i], bodies.b.angular) - dot(turn_of_a[i], bodies.a.angular);
    return i < translations ? turning + dot(along[i], bodies.b.linear - bodies.a.linear) : turning;
  }
  /// Change of row i's velocity per unit impulse on row j.
  FATHOM_LANE_FUNCTION L response(int i, int j) const {
    L sum = dot(turn_of_b[i], spin_of_b[j]);
    if constexpr (!only_pushes_b) sum = sum + dot(turn_of_a[i], spin_of_a[j]);
    if constexpr (couples) {
      return i < translations ? sum + dot(along[i], moved_apart(j)) : sum;
    } else {
      if (i >= translations || j >= translations) return sum;
      L inverse_mass = bodies.inverse_of_b().mass;
      if constexpr (!only_pushes_b) inverse_mass = inverse_mass + bodies.inverse_of_a().mass;
      return mul_add(sum, inverse_mass, dot(along[i], along[j]));
    }
  }
  /// As for a ball joint.
  FATHOM_LANE_FUNCTION L followed_share(const L (&impulses)[axis_count], L h) const {
    return followed_share(impulses, zero_vector<L>(), zero_vector<L>(), h, max_drift);
  }
  /// Adds to the rows' impulses.
  FATHOM_LANE_FUNCTION void push(GenericJointRow<L>& row, const L (&impulses)[axis_count]) {
    push(row, impulses, zero_vector<L>(), zero_vector<L>(), zero_vector<L>());
  }
  /// Re-applies the impulses so far along the current rows, as for a ball joint.
  FATHOM_LANE_FUNCTION void carry_along(GenericJointRow<L>& row, L h) {
    L impulses[axis_count];
    for (int i = 0; i < axis_count; ++i) impulses[i] = row.hold[i] + row.drive[i];
    const L share = followed_share(impulses, spun_a_, spun_b_, h, max_carry);
    for (int i = 0; i < axis_count; ++i) {
      impulses[i] = share * impulses[i];
      row.hold[i] = share * row.hold[i], row.drive[i] = share * row.drive[i];
    }
    push(row, impulses, row.given, row.moment_a, row.moment_b);
  }
  /// Splits off the part of the row's impulses that pulls axes back to their limits: it moves the bodies but must not
  /// persist.
  FATHOM_LANE_FUNCTION void set_pull_apart(GenericJointRow<L>& row, const L (&pull)[axis_count], L share) const {
    row.pulled = row.pulled_a = row.pulled_b = zero_vector<L>();
    for (int i = 0; i < axis_count; ++i) {
      const L impulse = share * pull[i];
      row.hold[i] = row.hold[i] - impulse;
      if (i < translations) row.pulled = mul_add(row.pulled, impulse, along[i]);
      row.pulled_b = mul_add(row.pulled_b, impulse, turn_of_b[i]);
      if constexpr (!only_pushes_b) row.pulled_a = mul_add(row.pulled_a, impulse, turn_of_a[i]);
    }
    row.given = row.given - row.pulled;
    row.moment_a = row.moment_a - row.pulled_a, row.moment_b = row.moment_b - row.pulled_b;
  }
  /// Adds the impulses so far to force and torque, in world axes.
  FATHOM_LANE_FUNCTION void add_up(GenericJointRow<L>& row) const {
    row.force = row.force + row.given;
    for (int i = 0; i < translations; ++i)
      row.torque = mul_add(row.torque, row.hold[translations + i] + row.drive[translations + i], about_[i]);
  }

 private:
  static constexpr bool couples = std::decay_t<decltype(std::declval<Bodies>().inverse_of_b())>::couples;

  VecOf<L> about_[translations];
  VecOf<L> reach_, arm_, arm_a_, gap_;
  VecOf<L> spun_a_, spun_b_;  ///< rad/s due to the row's impulses so far

  /// Relative linear velocity per unit impulse on row j.
  FATHOM_LANE_FUNCTION VecOf<L> moved_apart(int j) const {
    const VecOf<L> impulse = j < translations ? along[j] : zero_vector<L>();
    const VecOf<L> of_b = frame_b.moved_by(bodies.inverse_of_b(), impulse, turn_of_b[j]);
    if constexpr (only_pushes_b)
      return of_b;
    else
      return of_b + frame_a.moved_by(bodies.inverse_of_a(), impulse, turn_of_a[j]);
  }
  /// The same, less the spins already given to the bodies.
  FATHOM_LANE_FUNCTION L followed_share(const L (&impulses)[axis_count], VecOf<L> spun_a, VecOf<L> spun_b, L h,
                                        float angle) const {
    VecOf<L> by_a = zero_vector<L>(), by_b = zero_vector<L>();
    for (int i = 0; i < axis_count; ++i) {
      by_b = mul_add(by_b, impulses[i], spin_of_b[i]);
      if constexpr (!only_pushes_b) by_a = mul_add(by_a, impulses[i], spin_of_a[i]);
    }
    by_b = by_b - spun_b;
    if constexpr (!only_pushes_b) by_a = by_a - spun_a;
    return turning_share(by_a, by_b, h, angle);
  }
  /// Less the parts already applied.
  FATHOM_LANE_FUNCTION void push(GenericJointRow<L>& row, const L (&impulses)[axis_count], VecOf<L> given,
                                 VecOf<L> moment_a, VecOf<L> moment_b) {
    VecOf<L> linear = negated<L>(given), of_a = negated<L>(moment_a), of_b = negated<L>(moment_b);
    for (int i = 0; i < axis_count; ++i) {
      if (i < translations) linear = mul_add(linear, impulses[i], along[i]);
      of_b = mul_add(of_b, impulses[i], turn_of_b[i]);
      if constexpr (!only_pushes_b) of_a = mul_add(of_a, impulses[i], turn_of_a[i]);
    }
    frame_b.push(bodies.b, bodies.inverse_of_b(), linear, of_b);
    row.given = row.given + linear, row.moment_b = row.moment_b + of_b;
    if constexpr (!only_pushes_b) {
      frame_a.push(bodies.a, bodies.inverse_of_a(), negated<L>(linear), negated<L>(of_a));
      row.moment_a = row.moment_a + of_a;
    }
  }
  /// `spin`, limited so that a substep turns by at most `max_drift`.
  FATHOM_LANE_FUNCTION static VecOf<L> followed(VecOf<L> spin, L h) {
    const L most = splat<L>(max_drift * max_drift), turned = h * h * dot(spin, spin);
    return scale(root(most / larger(turned, most)), spin);
  }
  /// To second order, for turns up to `max_drift`, as for a ball joint.
  FATHOM_LANE_FUNCTION static VecOf<L> curve_of(VecOf<L> spin, VecOf<L> arm, L h) {
    const L most = splat<L>(max_drift * max_drift), turned = h * h * dot(spin, spin);
    return scale(splat<L>(0.5f) * h * (most / larger(turned, most)), cross(spin, cross(spin, arm)));
  }
  /// Sets the effect of row i, whose unit impulse is `impulse` with these moments on A and B, in world axes.
  FATHOM_LANE_FUNCTION void set_turns(int i, VecOf<L> impulse, VecOf<L> of_a, VecOf<L> of_b) {
    turn_of_a[i] = frame_a.from_world(of_a), turn_of_b[i] = frame_b.from_world(of_b);
    spin_of_b[i] = frame_b.spun_by(bodies.inverse_of_b(), impulse, turn_of_b[i]);
    if constexpr (!only_pushes_b) spin_of_a[i] = frame_a.spun_by(bodies.inverse_of_a(), impulse, turn_of_a[i]);
  }
  FATHOM_LANE_FUNCTION void set_positions(const GenericJointPlace<L>& row, const UnitQuat<L>& frame,
                                          const UnitQuat<L>& turned_b, VecOf<L> gap) {
    set_angles(row, frame, product(conjugate(frame), product(turned_b, row.frame_b)), about_);
    set_translations(row, frame, gap);
  }
  /// The first row of a distance joint is the distance; its others do not act.
  FATHOM_LANE_FUNCTION void set_translations(const GenericJointPlace<L>& row, const UnitQuat<L>& frame, VecOf<L> gap) {
    const L zero = splat<L>(0.0f), one = splat<L>(1.0f);
    const VecOf<L> units[] = {{one, zero, zero}, {zero, one, zero}, {zero, zero, one}};
    const L length = root(dot(gap, gap)), inverse = inverse_or_zero(length);
    for (int i = 0; i < translations; ++i) {
      along[i] = turned_by(frame, units[i]);
      value[i] = dot(along[i], gap);
    }
    const VecOf<L> line = scale(inverse, gap);
    along[0] = {choose(row.distance, line.x, along[0].x), choose(row.distance, line.y, along[0].y),
                choose(row.distance, line.z, along[0].z)};
    value[0] = choose(row.distance, length, value[0]);
  }
  /// For a distance joint: its line turns with the anchors, which end up farther apart.
  FATHOM_LANE_FUNCTION void set_drift(const GenericJointRow<L>& row, VecOf<L> gap, VecOf<L> speed, L h) {
    const L length = root(dot(gap, gap)), inverse = inverse_or_zero(length);
    for (int i = 0; i < translations; ++i) drift[i] = splat<L>(0.0f);
    const VecOf<L> across = cross(scale(h * inverse, gap), speed);
    const L turned = smaller(dot(across, across) * inverse * inverse, splat<L>(max_drift * max_drift));
    drift[0] = splat<L>(0.5f) * row.distance * turned * length * inverse_or_zero(h);
  }
  /// The part of a gap that the translations allow. The remainder is an error: if it counted as a lever of A, a joint
  /// that has been torn apart would turn A ever faster instead of closing.
  FATHOM_LANE_FUNCTION VecOf<L> slide_of(const GenericJointPlace<L>& row, VecOf<L> gap) const {
    for (int i = 0; i < translations; ++i) {
      const GenericAxis<L>& a = row.axes[i];
      const L beyond = value[i] - smaller(larger(value[i], a.lower), a.upper);
      gap = mul_add(gap, (row.distance - splat<L>(1.0f)) * larger(a.locked, a.limited) * beyond, along[i]);
    }
    return gap;
  }
  FATHOM_LANE_FUNCTION static L is_held_at_zero(const GenericAxis<L>& axis) {
    const L zero = splat<L>(0.0f), one = splat<L>(1.0f);
    return axis.locked * ((one - is_less(axis.lower, zero)) * (one - is_less(zero, axis.lower)));
  }
  FATHOM_LANE_FUNCTION void set_angles(const GenericJointPlace<L>& row, const UnitQuat<L>& frame, const UnitQuat<L>& q,
                                       VecOf<L> (&about)[translations]) {
    const L zero = splat<L>(0.0f), one = splat<L>(1.0f);
    // B's axis x in A's frame.
    const VecOf<L> x = turned_by(q, VecOf<L>{one, zero, zero});
    // Hinges must not hold upside down; with one locked swing both orientations are the same.
    const L both_swings = row.axes[translations + 1].locked * row.axes[translations + 2].locked;
    const L hooke = row.axes[translations].locked * ((one - both_swings) * (one - row.cone));
    const L sign = choose(is_less(q.w, zero), splat<L>(-1.0f), one);
    // If one swing is locked at zero, B turns about an axis of A and about its own x. This twist has no largest swing.
    const L no_y = is_held_at_zero(row.axes[translations + 1]) * (one - row.axes[translations + 2].locked);
    const L no_z = is_held_at_zero(row.axes[translations + 2]) * (one - row.axes[translations + 1].locked);
    const L one_swing = no_y + no_z;
    // Nor has a locked twist between two swings: that of a Hooke's joint, A's axis y perpendicular to B's z.
    const VecOf<L> y = turned_by(q, VecOf<L>{zero, one, zero}), z = turned_by(q, VecOf<L>{zero, zero, one});
    const L across_x = larger(root(mul_add(z.x * z.x, z.z, z.z)), splat<L>(1e-6f)), inverse_x = one / across_x;
    const L is_whole = larger(hooke, one_swing);
    const L twist = angle_of(choose(is_whole, choose(no_y, y.z, zero - z.y), sign * q.v.x),
                             choose(is_whole, choose(no_y, z.z, choose(no_z, y.y, across_x)), sign * q.w));
    value[translations] = choose(is_whole, twist, twist + twist);
    const L bisector = one / larger(one + x.x, splat<L>(0.01f));
    const L side = choose(both_swings * is_less(x.x, zero), splat<L>(-1.0f), one);
    const L least = splat<L>(1e-6f);
    const L across_y = larger(root(mul_add(x.x * x.x, x.y, x.y)), least) * side;
    const L across_z = larger(root(mul_add(x.x * x.x, x.z, x.z)), least) * side;
    const L off = root(mul_add(x.y * x.y, x.z, x.z)), inverse_off = inverse_or_zero(off);
    const VecOf<L> swing_y{zero - x.y / across_y, x.x / across_y, zero};
    const VecOf<L> swing_z{zero - x.z / across_z, zero, x.x / across_z};
    value[translations + 1] = angle_of(choose(row.cone, off, zero - x.z), choose(row.cone, x.x, across_y));
    value[translations + 2] = angle_of(x.y, across_z);
    const VecOf<L> twist_axis{choose(one_swing, x.x, choose(hooke, z.z * inverse_x, one)),
                              choose(one_swing, x.y, choose(hooke, zero, x.y * bisector)),
                              choose(one_swing, x.z, choose(hooke, (zero - z.x) * inverse_x, x.z * bisector))};
    about[0] = turned_by(frame, twist_axis);
    about[1] = turned_by(
        frame, VecOf<L>{choose(row.cone, zero, swing_y.x), choose(row.cone, (zero - x.z) * inverse_off, swing_y.y),
                        choose(row.cone, x.y * inverse_off, zero)});
    about[2] = turned_by(frame, swing_z);
  }
};

/// Sets frames, arms and gap, for bodies with orientations `q_a` and `q_b`; `between` leads from A's centre to B's (m),
/// `on_a` and `on_b` are the joint frames on them.
template <class L>
FATHOM_LANE_FUNCTION void place_generic_joint(const UnitQuat<L>& q_a, const UnitQuat<L>& q_b, VecOf<L> between,
                                              const UnitQuat<L>& on_a, const UnitQuat<L>& on_b, VecOf<L> anchor_a,
                                              VecOf<L> anchor_b, GenericJointPlace<L>& place) {
  place.frame_a = product(q_a, on_a), place.frame_b = product(q_b, on_b);
  place.arm_a = turned_by(q_a, anchor_a), place.arm_b = turned_by(q_b, anchor_b);
  place.gap = between + (place.arm_b - place.arm_a);
}
/// Also clears the sums.
template <class L>
FATHOM_LANE_FUNCTION void prepare_generic_joint(const UnitQuat<L>& q_a, const UnitQuat<L>& q_b, VecOf<L> between,
                                                const UnitQuat<L>& on_a, const UnitQuat<L>& on_b, VecOf<L> anchor_a,
                                                VecOf<L> anchor_b, GenericJointRow<L>& row) {
  place_generic_joint(q_a, q_b, between, on_a, on_b, anchor_a, anchor_b, row);
  const L zero = splat<L>(0.0f);
  row.given = row.moment_a = row.moment_b = row.force = row.torque = row.pull = {zero, zero, zero};
  row.pulled = row.pulled_a = row.pulled_b = {zero, zero, zero};
}
