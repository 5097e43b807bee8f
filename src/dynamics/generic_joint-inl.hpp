// The rows of a generic or distance joint over a lane type L, as those of ball joints (dynamics/ball_joint-inl.hpp),
// which is included first.
//
// Six axes: three translations of B's anchor in A's frame, the twist about B's axis x and its two swings. The relative
// rotation is taken apart into a swing of axis x and the twist that it leaves; the twist's rate is that about the
// bisector of the two axes x, so both hold for any angle short of a swing by pi. Translations act on both bodies at B's
// anchor, so that a slider that is far out keeps the angular momentum.
//
// A sweep solves all axes at once: what is locked is eliminated (Gauss-Jordan), which leaves of the others the masses
// that the locked ones let through. Then drives are solved as soft rows of these, and again with the limits that their
// result would break and with what exceeds its largest force. A substep is one of RATTLE, as a ball joint's.

inline constexpr int axis_count = 6, translations = 3;

/// What an axis asks of a substep; `generic_axis` makes it of a definition. An axis that is neither is free.
template <class L>
struct GenericAxis {
  L locked, limited;  ///< 1 or 0
  L lower, upper;     ///< m or rad; of a locked axis both are where it is held
  /// Of a drive: it wants the velocity approach (target - x) + velocity - (compliance + response K) impulse, K being
  /// what a unit of impulse changes the axis' velocity by.
  L target, approach, velocity, compliance, response;
  L most;  ///< N·s or N·m·s; 0: no drive
  L restitution;
  L armature;  ///< kg or kg·m²
};
inline constexpr int axis_field_count = 12;

/// What outlasts a sweep of one joint. Frames, arms and the gap are those of the step's beginning.
template <class L>
struct GenericJointRow {
  UnitQuat<L> frame_a, frame_b;  ///< the joint's frames in the world
  VecOf<L> arm_a, arm_b;         ///< m, from the centres of mass, world axes
  VecOf<L> gap;                  ///< m, from A's anchor to B's
  VecOf<L> pull;                 ///< m/s², see BallJointRow
  L bias_rate, mass_scale, impulse_scale;
  L rigid;     ///< 1, or 0 where what is locked is a spring
  L distance;  ///< 1 of a distance joint
  L cone;      ///< 1 where the swings have a cone in place of two axes
  GenericAxis<L> axes[axis_count];

  L hold[axis_count];           ///< N·s or N·m·s on B, of what is locked or at a limit, over the substep
  L drive[axis_count];          ///< of drives
  VecOf<L> given;               ///< N·s on B that all of them have been so far
  VecOf<L> moment_a, moment_b;  ///< N·m·s of it about the centres, as spins are written; A gets its reverse
  VecOf<L> force, torque;       ///< N·s and N·m·s on B over the step, world axes

  // Of joints that move (see JointUse): what the last sweep pulled axes back with that were beyond their limits, which
  // the next one takes back: as `given` and its moments.
  VecOf<L> pulled, pulled_a, pulled_b;

  // Of joints that react to speeds.
  L min_hit;             ///< m/s or rad/s, above which limits throw back
  L bounce[axis_count];  ///< m/s or rad/s with which the substep leaves a limit that it hit
  L rate[axis_count];    ///< as the last sweep has left them
};

/// What the axes of a joint have that not all have, or of several side by side some of them.
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

/// `a`, no longer than `most`.
template <class L>
FATHOM_LANE_FUNCTION L bounded(L a, L most) {
  return smaller(larger(a, splat<L>(0.0f) - most), most);
}

/// The six rows of a joint as they are now: where they stand, what they act on.
template <class L, class Bodies>
struct GenericJointRows {
  static constexpr bool only_pushes_b = Bodies::only_pushes_b;
  using Frame = SpinFrame<L, Bodies::all_isotropic>;

  Bodies& bodies;
  Frame frame_a, frame_b;                                 ///< that spins are written in
  VecOf<L> along[translations];                           ///< unit vectors in the world
  VecOf<L> turn_of_a[axis_count], turn_of_b[axis_count];  ///< m or 1: moment of a unit impulse, as spins are written
  VecOf<L> spin_of_a[axis_count], spin_of_b[axis_count];  ///< and the spin that it gives
  L value[axis_count];                                    ///< m or rad
  L drift[axis_count];  ///< m/s or rad/s by which a substep changes it more than its rate says

  /// Where they stand alone: `along`, `value`, `reach`, `arm`, `torque_axis`.
  FATHOM_LANE_FUNCTION GenericJointRows(const GenericJointRow<L>& row, Bodies& of)
      : GenericJointRows(row, of, rotation_by<L>(of.a.turned), rotation_by<L>(of.b.turned)) {}
  /// Of bodies that have turned by these since the step began.
  FATHOM_LANE_FUNCTION GenericJointRows(const GenericJointRow<L>& row, Bodies& of, const UnitQuat<L>& turned_a,
                                        const UnitQuat<L>& turned_b)
      : bodies(of), frame_a(turned_a, of.a), frame_b(turned_b, of.b) {
    arm_a_ = turned_by(turned_a, row.arm_a), arm_ = turned_by(turned_b, row.arm_b);
    gap_ = row.gap + ((bodies.b.moved + (arm_ - row.arm_b)) - (bodies.a.moved + (arm_a_ - row.arm_a)));
    set_positions(row, product(turned_a, row.frame_a), turned_b, gap_);
    reach_ = arm_a_ + slide_of(row, gap_);
    spun_a_ = spun_b_ = nothing();
  }
  FATHOM_LANE_FUNCTION GenericJointRows(const GenericJointRow<L>& row, Bodies& of, L h) : GenericJointRows(row, of) {
    // As the last substep has left them: what it gave acts again, along arms that have turned since, and spins light
    // bodies as they will not spin once the sweep has put that right.
    spun_b_ = frame_b.spun_by(of.inverse_of_b(), row.given, row.moment_b);
    const VecOf<L> omega_b = frame_b.in_world(of.b.angular - spun_b_);
    const VecOf<L> linear_b =
        frame_b.moved(of.b.linear, of.inverse_of_b(), negative(row.given), negative(row.moment_b));
    VecOf<L> omega_a = frame_a.in_world(of.a.angular), linear_a = of.a.linear;
    if constexpr (!only_pushes_b) {
      spun_a_ = frame_a.spun_by(of.inverse_of_a(), row.given, row.moment_a);
      omega_a = frame_a.in_world(of.a.angular + spun_a_);
      linear_a = frame_a.moved(of.a.linear, of.inverse_of_a(), row.given, row.moment_a);
    }
    const VecOf<L> speed_b = linear_b + cross(omega_b, arm_);
    set_drift(row, gap_, speed_b - (linear_a + cross(omega_a, arm_a_)), h);
    const VecOf<L> apart = speed_b - (linear_a + cross(omega_a, reach_));  // as A sees it
    const L slides = splat<L>(1.0f) - row.distance;
    VecOf<L> curve = curve_of(omega_b, arm_, h) - curve_of(omega_a, mul_add(arm_a_, slides, reach_ - arm_a_), h);
    const VecOf<L> slow_a = followed(omega_a, h), relative = followed(omega_b, h) - slow_a;
    curve = curve - scale(slides * h, cross(slow_a, apart));
    for (int i = 0; i < translations; ++i) {
      set_turns(i, along[i], cross(reach_, along[i]), cross(arm_, along[i]));
      set_turns(translations + i, nothing(), about_[i], about_[i]);
      drift[i] = drift[i] + dot(along[i], curve) - splat<L>(0.5f) * h * dot(along[i], row.pull);
      drift[translations + i] = splat<L>(0.5f) * h * dot(cross(slow_a, about_[i]), relative);
    }
  }

  /// m, from A's and from B's centre to where the joint acts, and the axes of its rotations, all in the world.
  FATHOM_LANE_FUNCTION VecOf<L> reach() const { return reach_; }
  FATHOM_LANE_FUNCTION VecOf<L> arm() const { return arm_; }
  FATHOM_LANE_FUNCTION VecOf<L> torque_axis(int i) const { return about_[i]; }
  FATHOM_LANE_FUNCTION L velocity(int i) const {
    const L turning = dot(turn_of_b[i], bodies.b.angular) - dot(turn_of_a[i], bodies.a.angular);
    return i < translations ? turning + dot(along[i], bodies.b.linear - bodies.a.linear) : turning;
  }
  /// What a unit of impulse on row j changes row i's velocity by.
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
  /// As a ball joint's.
  FATHOM_LANE_FUNCTION L followed_share(const L (&impulses)[axis_count], L h) const {
    return followed_share(impulses, nothing(), nothing(), h, max_drift);
  }
  /// The rows' impulses are larger by these from now on.
  FATHOM_LANE_FUNCTION void push(GenericJointRow<L>& row, const L (&impulses)[axis_count]) {
    push(row, impulses, nothing(), nothing(), nothing());
  }
  /// The impulses so far act along the rows as they are now, as a ball joint's.
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
  /// So much of the row's impulses pulls axes back to their limits. It is there to move the bodies, not to last.
  FATHOM_LANE_FUNCTION void set_pull_apart(GenericJointRow<L>& row, const L (&pull)[axis_count], L share) const {
    row.pulled = row.pulled_a = row.pulled_b = nothing();
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
  /// What the impulses so far are in the world.
  FATHOM_LANE_FUNCTION void add_up(GenericJointRow<L>& row) const {
    row.force = row.force + row.given;
    for (int i = 0; i < translations; ++i)
      row.torque = mul_add(row.torque, row.hold[translations + i] + row.drive[translations + i], about_[i]);
  }

 private:
  static constexpr bool couples = std::decay_t<decltype(std::declval<Bodies>().inverse_of_b())>::couples;

  VecOf<L> about_[translations];
  VecOf<L> reach_, arm_, arm_a_, gap_;
  VecOf<L> spun_a_, spun_b_;  ///< rad/s that the row's impulses so far have given

  FATHOM_LANE_FUNCTION static VecOf<L> nothing() {
    const L zero = splat<L>(0.0f);
    return {zero, zero, zero};
  }
  FATHOM_LANE_FUNCTION static VecOf<L> negative(VecOf<L> v) { return nothing() - v; }

  /// What a unit of impulse on row j gives of relative linear velocity.
  FATHOM_LANE_FUNCTION VecOf<L> moved_apart(int j) const {
    const VecOf<L> impulse = j < translations ? along[j] : nothing();
    const VecOf<L> of_b = frame_b.moved_by(bodies.inverse_of_b(), impulse, turn_of_b[j]);
    if constexpr (only_pushes_b)
      return of_b;
    else
      return of_b + frame_a.moved_by(bodies.inverse_of_a(), impulse, turn_of_a[j]);
  }
  /// Less the spins that the bodies have been given already.
  FATHOM_LANE_FUNCTION L followed_share(const L (&impulses)[axis_count], VecOf<L> spun_a, VecOf<L> spun_b, L h,
                                        float angle) const {
    VecOf<L> by_a = nothing(), by_b = nothing();
    for (int i = 0; i < axis_count; ++i) {
      by_b = mul_add(by_b, impulses[i], spin_of_b[i]);
      if constexpr (!only_pushes_b) by_a = mul_add(by_a, impulses[i], spin_of_a[i]);
    }
    by_b = by_b - spun_b;
    if constexpr (!only_pushes_b) by_a = by_a - spun_a;
    return turning_share(by_a, by_b, h, angle);
  }
  /// Less what has been given of them.
  FATHOM_LANE_FUNCTION void push(GenericJointRow<L>& row, const L (&impulses)[axis_count], VecOf<L> given,
                                 VecOf<L> moment_a, VecOf<L> moment_b) {
    VecOf<L> linear = nothing() - given, of_a = nothing() - moment_a, of_b = nothing() - moment_b;
    for (int i = 0; i < axis_count; ++i) {
      if (i < translations) linear = mul_add(linear, impulses[i], along[i]);
      of_b = mul_add(of_b, impulses[i], turn_of_b[i]);
      if constexpr (!only_pushes_b) of_a = mul_add(of_a, impulses[i], turn_of_a[i]);
    }
    push(bodies.b, frame_b, bodies.inverse_of_b(), linear, of_b);
    row.given = row.given + linear, row.moment_b = row.moment_b + of_b;
    if constexpr (!only_pushes_b) {
      push(bodies.a, frame_a, bodies.inverse_of_a(), negative(linear), negative(of_a));
      row.moment_a = row.moment_a + of_a;
    }
  }
  template <class Side, class Inertia>
  FATHOM_LANE_FUNCTION static void push(Side& side, const Frame& frame, const Inertia& inertia, VecOf<L> impulse,
                                        VecOf<L> moment) {
    side.linear = frame.moved(side.linear, inertia, impulse, moment);
    side.angular = side.angular + frame.spun_by(inertia, impulse, moment);
  }

  /// As much of a spin as a substep turns by `max_drift`.
  FATHOM_LANE_FUNCTION static VecOf<L> followed(VecOf<L> spin, L h) {
    const L most = splat<L>(max_drift * max_drift), turned = h * h * dot(spin, spin);
    return scale(root(most / larger(turned, most)), spin);
  }
  /// To second order, of turns up to `max_drift`, as a ball joint's.
  FATHOM_LANE_FUNCTION static VecOf<L> curve_of(VecOf<L> spin, VecOf<L> arm, L h) {
    const L most = splat<L>(max_drift * max_drift), turned = h * h * dot(spin, spin);
    return scale(splat<L>(0.5f) * h * (most / larger(turned, most)), cross(spin, cross(spin, arm)));
  }
  /// Of row i, whose unit of impulse acts with these moments, in world axes.
  FATHOM_LANE_FUNCTION void set_turns(int i, VecOf<L> impulse, VecOf<L> of_a, VecOf<L> of_b) {
    turn_of_a[i] = frame_a.from_world(of_a), turn_of_b[i] = frame_b.from_world(of_b);
    spin_of_b[i] = frame_b.spun_by(bodies.inverse_of_b(), impulse, turn_of_b[i]);
    if constexpr (!only_pushes_b) spin_of_a[i] = frame_a.spun_by(bodies.inverse_of_a(), impulse, turn_of_a[i]);
  }
  FATHOM_LANE_FUNCTION void set_positions(const GenericJointRow<L>& row, const UnitQuat<L>& frame,
                                          const UnitQuat<L>& turned_b, VecOf<L> gap) {
    set_angles(row, frame, product(conjugate(frame), product(turned_b, row.frame_b)), about_);
    set_translations(row, frame, gap);
  }
  /// Of a distance joint the first row is the distance, and no other acts.
  FATHOM_LANE_FUNCTION void set_translations(const GenericJointRow<L>& row, const UnitQuat<L>& frame, VecOf<L> gap) {
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
  /// Of a distance joint, whose line turns with the anchors, so that these come out farther apart.
  FATHOM_LANE_FUNCTION void set_drift(const GenericJointRow<L>& row, VecOf<L> gap, VecOf<L> speed, L h) {
    const L length = root(dot(gap, gap)), inverse = inverse_or_zero(length);
    for (int i = 0; i < translations; ++i) drift[i] = splat<L>(0.0f);
    const VecOf<L> across = cross(scale(h * inverse, gap), speed);
    const L turned = smaller(dot(across, across) * inverse * inverse, splat<L>(max_drift * max_drift));
    drift[0] = splat<L>(0.5f) * row.distance * turned * length * inverse_or_zero(h);
  }
  /// The part of a gap that the translations allow. What is beyond them is an error: as a lever of A, a joint that has
  /// been torn apart would turn A ever faster instead of closing.
  FATHOM_LANE_FUNCTION VecOf<L> slide_of(const GenericJointRow<L>& row, VecOf<L> gap) const {
    for (int i = 0; i < translations; ++i) {
      const GenericAxis<L>& a = row.axes[i];
      const L beyond = value[i] - smaller(larger(value[i], a.lower), a.upper);
      gap = mul_add(gap, (row.distance - splat<L>(1.0f)) * larger(a.locked, a.limited) * beyond, along[i]);
    }
    return gap;
  }
  FATHOM_LANE_FUNCTION void set_angles(const GenericJointRow<L>& row, const UnitQuat<L>& frame, const UnitQuat<L>& q,
                                       VecOf<L> (&about)[translations]) {
    const L zero = splat<L>(0.0f), one = splat<L>(1.0f);
    // B's axis x in A's frame.
    const VecOf<L> x = turned_by(q, VecOf<L>{one, zero, zero});
    // Hinges must not hold upside down; of one locked swing both ways round are the same.
    const L both_swings = row.axes[translations + 1].locked * row.axes[translations + 2].locked;
    const L hooke = row.axes[translations].locked * ((one - both_swings) * (one - row.cone));
    const L sign = choose(is_less(q.w, zero), splat<L>(-1.0f), one);
    const L twist = angle_of(sign * q.v.x, sign * q.w);
    // A locked twist between free swings is that of a Hooke's joint, A's axis y across B's z: no swing is too large.
    const VecOf<L> z = turned_by(q, VecOf<L>{zero, zero, one});
    const L across_x = larger(root(mul_add(z.x * z.x, z.z, z.z)), splat<L>(1e-6f)), inverse_x = one / across_x;
    value[translations] = choose(hooke, angle_of(zero - z.y, across_x), twist + twist);
    const L bisector = one / larger(one + x.x, splat<L>(0.01f));
    const L side = choose(both_swings * is_less(x.x, zero), splat<L>(-1.0f), one);
    const L least = splat<L>(1e-6f);
    const L across_y = larger(root(mul_add(x.x * x.x, x.y, x.y)), least) * side;
    const L across_z = larger(root(mul_add(x.x * x.x, x.z, x.z)), least) * side;
    const L off = root(mul_add(x.y * x.y, x.z, x.z)), inverse_off = inverse_or_zero(off);
    const VecOf<L> swing_y{zero - x.y / across_y, x.x / across_y, zero};
    const VecOf<L> swing_z{zero - x.z / across_z, zero, x.x / across_z};
    value[translations + 1] = choose(row.cone, angle_of(off, x.x), angle_of(zero - x.z, across_y));
    value[translations + 2] = angle_of(x.y, across_z);
    about[0] = turned_by(frame, VecOf<L>{choose(hooke, z.z * inverse_x, one), choose(hooke, zero, x.y * bisector),
                                         choose(hooke, (zero - z.x) * inverse_x, x.z * bisector)});
    about[1] = turned_by(
        frame, VecOf<L>{choose(row.cone, zero, swing_y.x), choose(row.cone, (zero - x.z) * inverse_off, swing_y.y),
                        choose(row.cone, x.y * inverse_off, zero)});
    about[2] = turned_by(frame, swing_z);
  }
};

/// Equations of six rows: `response` x = `wanted`, and which of them have been solved for.
template <class L>
struct GenericSystem {
  L response[axis_count][axis_count];
  L wanted[axis_count];
  L pull[axis_count];     ///< of `wanted` what brings axes back to their limits; of `solve_free_axes` alone
  L inverse[axis_count];  ///< of the solved ones' diagonal; of others 0

  /// Solves row i for its impulse, where `active` is 1, and takes it out of all others.
  template <bool pulls = false>
  FATHOM_LANE_FUNCTION void eliminate(int i, L active, L compliance) {
    const L pivot = active * inverse_or_zero(response[i][i] + compliance);
    inverse[i] = inverse[i] + pivot;
    for (int j = 0; j < axis_count; ++j) {
      if (j == i) continue;
      const L share = splat<L>(0.0f) - response[j][i] * pivot;
      wanted[j] = mul_add(wanted[j], share, wanted[i]);
      if constexpr (pulls) pull[j] = mul_add(pull[j], share, pull[i]);
      for (int k = 0; k < axis_count; ++k)
        if (k != i) response[j][k] = mul_add(response[j][k], share, response[i][k]);
      response[j][i] = choose(active, splat<L>(0.0f), response[j][i]);
    }
  }
  /// Row i's impulse is `impulse`.
  FATHOM_LANE_FUNCTION void give(int i, L impulse) {
    for (int j = 0; j < axis_count; ++j) wanted[j] = mul_add(wanted[j], splat<L>(0.0f) - impulse, response[j][i]);
  }
};

/// What an axis that is not locked does in a sweep.
template <class L>
struct FreeAxis {
  L is_driven, is_at_limit;  ///< 1 or 0: solved as a soft row, as a rigid one
  L compliance, aim;         ///< of the drive: wanted velocity is aim - compliance · impulse
  L bound;                   ///< m/s or rad/s with which it comes to its limit
  L pull;                    ///< of `bound` what it comes back with from beyond it
  L given;                   ///< N·s that it gets in any case
};

// Armature I takes the impulse I (v - v') from whatever changes the rate of its axis from v to v': a drive that holds
// the rate as it was, of compliance 1 / I. Side by side with a drive, that wants aim - compliance · impulse, it is one
// that wants
//   (aim + compliance I v) / (1 + compliance I) - compliance / (1 + compliance I) · impulse
// until the drive gives its most.

/// A drive with an armature beside it, or the armature alone.
template <class L>
FATHOM_LANE_FUNCTION void add_armature(FreeAxis<L>& f, L armature, L rate) {
  const L zero = splat<L>(0.0f), one = splat<L>(1.0f), least = splat<L>(1e-30f);
  const L product = f.compliance * armature, sum = one + product, has = is_less(zero, armature);
  const L aim = mul_add(f.aim, product, rate) / sum, compliance = f.compliance / sum;
  f.aim = choose(has, choose(f.is_driven, aim, rate), f.aim);
  f.compliance = choose(has, choose(f.is_driven, compliance, one / larger(armature, least)), f.compliance);
  f.is_driven = larger(f.is_driven, has);
}

/// The same with a drive that gives `most`, or its reverse.
template <class L>
FATHOM_LANE_FUNCTION void add_limit_to_armature(FreeAxis<L>& f, L armature, L rate, L most) {
  const L compliance = splat<L>(1.0f) / larger(armature, splat<L>(1e-30f));
  f.aim = mul_add(rate, compliance, most);
  f.compliance = compliance;
}

/// Solves the axes that are not locked, of a system whose locked ones have been eliminated.
template <class L>
FATHOM_LANE_FUNCTION void solve_free_axes(GenericSystem<L>& system, const GenericJointRow<L>& row,
                                          const FreeAxis<L> (&axes)[axis_count]) {
  for (int i = 0; i < axis_count; ++i) system.give(i, axes[i].given);
  for (int i = 0; i < axis_count; ++i) {
    const FreeAxis<L>& axis = axes[i];
    const L compliance = choose(axis.is_driven, axis.compliance, splat<L>(0.0f));
    const L aim = axis.aim - axis.compliance * row.drive[i];
    const L more = choose(axis.is_driven, aim, choose(axis.is_at_limit, axis.bound, splat<L>(0.0f)));
    system.wanted[i] = system.wanted[i] + more;
    system.pull[i] = system.pull[i] + axis.pull;
    system.template eliminate<true>(i, larger(axis.is_driven, axis.is_at_limit), compliance);
  }
}

/// What is locked is soft: it lets a part of what pushes it through, and gives a part of its impulses back. So what its
/// elimination leaves of the other axes is so much of it, and the rest of what was before.
template <class L>
FATHOM_LANE_FUNCTION void soften(GenericSystem<L>& system, const GenericSystem<L>& before,
                                 const GenericJointRow<L>& row) {
  const L one = splat<L>(1.0f);
  for (int i = 0; i < axis_count; ++i) {
    const L is_free = one - row.axes[i].locked, part = is_free * row.impulse_scale;
    L wanted = before.wanted[i];
    for (int j = 0; j < axis_count; ++j) {
      wanted = mul_add(wanted, row.axes[j].locked * row.hold[j], before.response[i][j]);
      const L share = part * (one - row.axes[j].locked);
      system.response[i][j] = mul_add(system.response[i][j], share, before.response[i][j] - system.response[i][j]);
    }
    system.wanted[i] = mul_add(system.wanted[i], part, wanted - system.wanted[i]);
  }
}

/// Whether a drive that is not at a limit would give more than its most for an impulse `wanted`, which leaves the axis
/// the rate `speed`. One beside an armature becomes one that gives its most.
template <class L>
FATHOM_LANE_FUNCTION L exceeds_beside_armature(FreeAxis<L>& f, const GenericAxis<L>& a, L rate, L wanted, L speed) {
  const L zero = splat<L>(0.0f), one = splat<L>(1.0f), has = is_less(zero, a.armature);
  const L of_drive = wanted - a.armature * (rate - speed);
  const L exceeds = is_less(a.most, larger(of_drive, zero - of_drive)) * (one - f.is_at_limit);
  FreeAxis<L> at_most = f;
  add_limit_to_armature(at_most, a.armature, rate, bounded(of_drive, a.most));
  f.aim = choose(exceeds * has, at_most.aim, f.aim);
  f.compliance = choose(exceeds * has, at_most.compliance, f.compliance);
  return exceeds * (one - has);
}

/// The rate that a limit throws an axis back with; `side` is -1 of the lower limit, 1 of the upper one, or 0. What it
/// came with is its last rate: the bodies' velocities have impulses of the last substep in them, repeated.
template <class L>
FATHOM_LANE_FUNCTION L bounce_of(const GenericJointRow<L>& row, int i, L side) {
  const L is_hit = is_less(row.min_hit, side * row.rate[i]);
  return splat<L>(0.0f) - is_hit * row.axes[i].restitution * row.rate[i];
}

/// What limits and drives make of a system, after what is locked. Two rounds: one without limits and without bounds of
/// drives, and one with those that its result exceeds.
template <class L, class Rows>
FATHOM_LANE_FUNCTION void drive_and_limit(GenericSystem<L>& system, const GenericSystem<L>& before,
                                          GenericJointRow<L>& row, const Rows& rows, L h, bool reacts,
                                          L (&hold)[axis_count], L (&drive)[axis_count], L (&pull)[axis_count]) {
  soften(system, before, row);
  const L zero = splat<L>(0.0f), one = splat<L>(1.0f), turn = splat<L>(3.14159265f);
  FreeAxis<L> axes[axis_count];
  for (int i = 0; i < axis_count; ++i) {
    const GenericAxis<L>& a = row.axes[i];
    FreeAxis<L>& f = axes[i];
    L off = a.target - rows.value[i];
    if (i == translations) {  // the short way round
      off = choose(is_less(turn, off), off - (turn + turn), off);
      off = choose(is_less(off, zero - turn), off + (turn + turn), off);
    }
    f.is_driven = is_less(zero, a.most);
    f.compliance = mul_add(a.compliance, a.response, system.response[i][i]);
    f.aim = mul_add(a.velocity, a.approach, off);
    f.is_at_limit = f.bound = f.pull = zero;
    f.given = zero - a.limited * row.hold[i];
    if (reacts) add_armature(f, a.armature, row.rate[i]);
  }
  GenericSystem<L> first = system;
  solve_free_axes(first, row, axes);
  for (int i = 0; i < axis_count; ++i) {
    const GenericAxis<L>& a = row.axes[i];
    FreeAxis<L>& f = axes[i];
    const L wanted = row.drive[i] + first.wanted[i] * first.inverse[i];
    const L speed = choose(f.is_driven, f.aim - f.compliance * wanted, zero - first.wanted[i]);
    const L at = mul_add(rows.value[i], h, speed + rows.drift[i]);
    const L below = is_less(at, a.lower), above = is_less(a.upper, at);
    const L most = splat<L>(max_pull);
    f.is_at_limit = a.limited * larger(below, above);
    const L to_bound = bounded((choose(below, a.lower, a.upper) - rows.value[i]) / h, most);
    f.bound = to_bound - rows.drift[i];
    f.pull = f.is_at_limit * choose(below, larger(to_bound, zero), smaller(to_bound, zero));
    L exceeds = is_less(a.most, larger(wanted, zero - wanted)) * (one - f.is_at_limit);
    const L bounded_drive = bounded(wanted, a.most);
    L at_bound = (f.aim - f.bound) / larger(f.compliance, splat<L>(1e-12f) * system.response[i][i]);
    if (reacts) {
      const L of_armature = a.armature * (row.rate[i] - f.bound);
      at_bound = bounded(at_bound - of_armature, a.most) + of_armature;
      exceeds = exceeds_beside_armature(f, a, row.rate[i], wanted, speed);
      row.bounce[i] = bounce_of(row, i, choose(below, splat<L>(-1.0f), f.is_at_limit));
    } else {
      at_bound = bounded(at_bound, a.most);
    }
    // At a limit its velocity is known, and with it what the drive gives.
    const L known = choose(f.is_at_limit, at_bound, bounded_drive) - row.drive[i];
    const L is_known = f.is_driven * larger(f.is_at_limit, exceeds);
    f.given = choose(is_known, known, zero) - a.limited * (one - f.is_at_limit) * row.hold[i];
    f.is_driven = f.is_driven * (one - is_known);
    drive[i] = row.drive[i] + choose(is_known, known, zero);
    hold[i] = row.hold[i] * (one - a.limited * (one - f.is_at_limit));
  }
  solve_free_axes(system, row, axes);
  for (int i = 0; i < axis_count; ++i) {
    const GenericAxis<L>& a = row.axes[i];
    const FreeAxis<L>& f = axes[i];
    const L change = system.wanted[i] * system.inverse[i];
    const L driven = bounded(row.drive[i] + change, a.most);
    drive[i] = choose(f.is_driven, reacts ? choose(is_less(zero, a.armature), row.drive[i] + change, driven) : driven,
                      drive[i]);
    // Of one that lasts, a part is given back, as of what is locked.
    const L lasts = is_less(zero, larger(row.hold[i], zero - row.hold[i]));
    const L soft = mul_add(row.mass_scale * change, zero - row.impulse_scale, row.hold[i]);
    L held = row.hold[i] + choose(lasts, soft, change);
    held = choose(is_less(rows.value[i] - a.lower, a.upper - rows.value[i]), larger(held, zero), smaller(held, zero));
    if (reacts) {
      // What a soft limit lets through, body and armature take together.
      const L short_by = f.is_at_limit * (row.hold[i] + change - held);
      drive[i] = mul_add(drive[i], a.armature / larger(system.inverse[i] + a.armature, splat<L>(1e-30f)), short_by);
    }
    hold[i] = choose(f.is_at_limit, held, hold[i]);
    const L soft_pull = system.pull[i] * system.inverse[i];
    pull[i] = choose(a.locked, row.mass_scale, choose(lasts, row.mass_scale, one)) * soft_pull;
    pull[i] =
        choose(f.is_at_limit, smaller(larger(pull[i], smaller(held, zero)), larger(held, zero)), pull[i] * a.locked);
  }
}

/// The last step's impulses act again at once.
template <class L, class Bodies>
FATHOM_LANE_FUNCTION void warm_start_generic_joint(GenericJointRow<L>& row, Bodies& bodies) {
  GenericJointRows<L, Bodies>(row, bodies, splat<L>(0.0f)).carry_along(row, splat<L>(0.0f));
}

/// What an axis does while velocities relax, besides what it did without armature and restitution.
template <class L>
struct RelaxingAxis {
  L spins, compliance;  ///< 1: nothing but its armature holds it
  L of_armature;        ///< N·s that this takes where a limit holds the axis

  FATHOM_LANE_FUNCTION RelaxingAxis(const GenericJointRow<L>& row, int i, L presses, L& wanted) {
    const L zero = splat<L>(0.0f), one = splat<L>(1.0f);
    const GenericAxis<L>& a = row.axes[i];
    const L at_limit = a.limited * presses, has = is_less(zero, a.armature);
    spins = has * ((one - a.locked) * (one - at_limit));
    compliance = spins / larger(a.armature, splat<L>(1e-30f));
    of_armature = at_limit * a.armature * (row.rate[i] - row.bounce[i]);
    wanted = wanted + (spins * row.rate[i] + at_limit * row.bounce[i]);
  }
  /// Of a row's change what the armature has given.
  FATHOM_LANE_FUNCTION L part_of(L change) const { return mul_add(of_armature, spins, change); }
};

/// The axes' relaxing impulses, of a system whose rows have been solved.
template <class L>
FATHOM_LANE_FUNCTION L relaxed_hold(const GenericJointRow<L>& row, int i, L change) {
  const L zero = splat<L>(0.0f), held = row.hold[i] + change;
  const L pressing = choose(is_less(row.hold[i], zero), smaller(held, zero), larger(held, zero));
  return choose(row.axes[i].limited, pressing, held);
}

/// What the last sweep has pulled back is where it is by now, or this one finds how far it is. Left in the velocities,
/// which the relaxing sweep would take it out of along rows that have turned, it would gain energy at every limit hit.
template <class L, class Bodies>
FATHOM_LANE_FUNCTION void take_back_pull(GenericJointRow<L>& row, Bodies& bodies) {
  const L zero = splat<L>(0.0f);
  const VecOf<L> none{zero, zero, zero};
  const auto take_back = [](auto& side, const auto& inertia, VecOf<L> impulse, VecOf<L> moment) FATHOM_LANE_LAMBDA {
    const SpinFrame<L, Bodies::all_isotropic> frame(rotation_by<L>(side.turned), side);
    side.linear = frame.moved(side.linear, inertia, impulse, moment);
    side.angular = side.angular + frame.spun_by(inertia, impulse, moment);
  };
  take_back(bodies.b, bodies.inverse_of_b(), none - row.pulled, none - row.pulled_b);
  if constexpr (!Bodies::only_pushes_b) take_back(bodies.a, bodies.inverse_of_a(), row.pulled, row.pulled_a);
  row.pulled = row.pulled_a = row.pulled_b = none;
}

/// One sweep of a substep of h seconds, as `solve_ball_joint`.
template <JointPass pass, class L, class Bodies>
FATHOM_LANE_FUNCTION L solve_generic_joint(GenericJointRow<L>& row, Bodies& bodies, L h, JointUse use,
                                           bool ends_substep) {
  constexpr bool relaxes = pass == JointPass::relax;
  const L zero = splat<L>(0.0f);
  constexpr bool splits = pass != JointPass::iterate;
  if (splits && use.moves) take_back_pull(row, bodies);
  GenericJointRows<L, Bodies> rows(row, bodies, h);
  L hold[axis_count], drive[axis_count], more[axis_count], pull_back[axis_count];
  if constexpr (!relaxes) rows.carry_along(row, h);
  GenericSystem<L> system;
  const L most = choose(row.rigid, splat<L>(max_pull), splat<L>(3e37f));
  for (int i = 0; i < axis_count; ++i) {
    const GenericAxis<L>& a = row.axes[i];
    const L pull = bounded(row.bias_rate * (rows.value[i] - a.lower), most);
    system.wanted[i] = zero - rows.velocity(i);
    if constexpr (!relaxes) system.wanted[i] = system.wanted[i] - a.locked * (rows.drift[i] + pull);
    system.pull[i] = zero - a.locked * row.rigid * pull;  // a spring's is there to stay
    system.inverse[i] = zero;
    for (int j = 0; j <= i; ++j) system.response[i][j] = system.response[j][i] = rows.response(i, j);
  }
  const GenericSystem<L> before = system;
  for (int i = 0; i < axis_count; ++i) {
    const GenericAxis<L>& a = row.axes[i];
    hold[i] = row.hold[i], drive[i] = row.drive[i];
    L active = a.locked, compliance = zero;
    if constexpr (relaxes) {
      const L presses = is_less(zero, larger(row.hold[i], zero - row.hold[i]));
      active = larger(a.locked * row.rigid, a.limited * presses);
      if (use.reacts) {
        const RelaxingAxis<L> axis(row, i, presses, system.wanted[i]);
        active = larger(active, axis.spins), compliance = axis.compliance;
      }
    }
    if (!relaxes && use.moves)
      system.template eliminate<true>(i, active, compliance);
    else
      system.eliminate(i, active, compliance);
  }
  if (!relaxes && use.moves) drive_and_limit(system, before, row, rows, h, use.reacts, hold, drive, pull_back);
  for (int i = 0; i < axis_count; ++i) {
    const GenericAxis<L>& a = row.axes[i];
    L change = system.wanted[i] * system.inverse[i];
    if constexpr (relaxes) {
      if (use.reacts) {
        L unused = zero;
        const L presses = is_less(zero, larger(row.hold[i], zero - row.hold[i]));
        const L of_armature = RelaxingAxis<L>(row, i, presses, unused).part_of(change);
        drive[i] = drive[i] + of_armature;
        change = change - of_armature;
      }
      hold[i] = relaxed_hold(row, i, change);
    } else {
      const L soft = mul_add(row.mass_scale * change, zero - row.impulse_scale, row.hold[i]);
      hold[i] = choose(a.locked, row.hold[i] + soft, hold[i]);
    }
    more[i] = (hold[i] - row.hold[i]) + (drive[i] - row.drive[i]);
  }
  const L share = rows.followed_share(more, h);
  const auto is_cut = is_above(splat<L>(1.0f), share);
  for (int i = 0; i < axis_count; ++i) {
    more[i] = share * more[i];
    row.hold[i] = select(is_cut, mul_add(row.hold[i], share, hold[i] - row.hold[i]), hold[i]);
    row.drive[i] = select(is_cut, mul_add(row.drive[i], share, drive[i] - row.drive[i]), drive[i]);
  }
  rows.push(row, more);
  if (pass == JointPass::soft && use.moves) rows.set_pull_apart(row, pull_back, share);
  // Of several sweeps per substep all begin with the rates that it began with.
  if (use.reacts && (pass != JointPass::iterate || ends_substep))
    for (int i = 0; i < axis_count; ++i) row.rate[i] = rows.velocity(i);
  if (ends_substep) rows.add_up(row);
  const VecOf<L> sum = (bodies.a.linear + bodies.a.angular) + (bodies.b.linear + bodies.b.angular) + row.given;
  return sum.x + (sum.y + sum.z);
}

/// Frames, arms, gap and the impulses to start from, of bodies with orientations `q_a` and `q_b` whose centres are
/// `between` apart (m, from A's to B's), and frames on them.
template <class L>
FATHOM_LANE_FUNCTION void prepare_generic_joint(const UnitQuat<L>& q_a, const UnitQuat<L>& q_b, VecOf<L> between,
                                                const UnitQuat<L>& on_a, const UnitQuat<L>& on_b, VecOf<L> anchor_a,
                                                VecOf<L> anchor_b, GenericJointRow<L>& row) {
  row.frame_a = product(q_a, on_a), row.frame_b = product(q_b, on_b);
  row.arm_a = turned_by(q_a, anchor_a), row.arm_b = turned_by(q_b, anchor_b);
  row.gap = between + (row.arm_b - row.arm_a);
  const L zero = splat<L>(0.0f);
  row.given = row.moment_a = row.moment_b = row.force = row.torque = row.pull = {zero, zero, zero};
  row.pulled = row.pulled_a = row.pulled_b = {zero, zero, zero};
}
