// Generic and distance joints as links of a mechanism: which of their coordinates are held, driven or free in a
// substep, and the impulses they give. A link is a body and the joint to its parent. Its coordinates are those of the
// body relative to the parent (dynamics/joint_elimination-inl.hpp); a joint's axes are those of B relative to A
// (dynamics/generic_rows-inl.hpp).
//
// Written for one lane and for eight: included in namespace fathom, where Real is a float, Mask a bool and Vec3 that of
// fathom/math.hpp (dynamics/joint_link.hpp), and in fathom::wide, where they have eight lanes
// (dynamics/lane_eight.hpp). Each lane is a different mechanism of the same shape: which axes are locked, limited or
// driven is the same in all of them (native/mechanisms.cpp, `shape_of`). No result depends on the other lanes.

/// Motion of a body, in world axes.
struct LinkMotion {
  Vec3 moved, turned;       ///< m and rad, since the step began
  Vec3 linear, angular;     ///< m/s and rad/s
  Flag is_isotropic;        ///< same in all lanes
  UnitQuat<Real> rotation;  ///< by `turned`
  UnitQuat<Real> ahead;     ///< and at the substep's end: by `turned_ahead`

  /// At the start of a step.
  FATHOM_LANE_FUNCTION static LinkMotion at_start(Vec3 linear, Vec3 angular) {
    const UnitQuat<Real> unturned{splat<Real>(1), {}};
    return {{}, {}, linear, angular, all_set, unturned, unturned};
  }

  /// Rotation vector (rad) since the step began, at the end of a substep of length h (s). Those of isotropic bodies are
  /// summed up, those of others are exact (`turned_so_far`).
  FATHOM_LANE_FUNCTION Vec3 turned_ahead(Real h) const {
    return everywhere(is_set(is_isotropic)) ? mul_add(turned, h, angular) : turned_further(turned, h * angular);
  }
};

/// Where a body is as the step begins, and its velocity.
struct LinkStart {
  Vec3 position;
  UnitQuat<Real> rotation;
  Vec3 linear, angular;
};

/// A joint's two bodies by their role in the tree.
struct LinkPair {
  const LinkMotion &body, &parent;
};

/// Which limits act and which drives are at their largest force, by axis; a solution revises these before it is
/// accepted.
struct LinkLimits {
  Flag at_limit[axis_count], at_upper[axis_count];
  Flag at_most[axis_count], at_minus[axis_count];  ///< of drives: at the largest force; in the negative direction
  Real bounce[axis_count];                         ///< m/s or rad/s at which the axis bounces off a limit
};

/// The joint to a link's parent.
class JointLink {
 public:
  /// Impulse on the body at the joint in this substep: N·s and N·m·s.
  FATHOM_LANE_FUNCTION Vec3 force() const { return force_; }
  FATHOM_LANE_FUNCTION Vec3 torque() const { return torque_; }
  /// m, from the centres of the body and of the parent to the point where the joint acts.
  FATHOM_LANE_FUNCTION Vec3 arm() const { return is_b() ? arm_b_ : reach_a_; }
  FATHOM_LANE_FUNCTION Vec3 parent_arm() const { return is_b() ? reach_a_ : arm_b_; }
  /// Whether all rotations are held.
  FATHOM_LANE_FUNCTION Mask is_stiff() const {
    return inverted(either(freedom_.has(3), either(freedom_.has(4), freedom_.has(5))));
  }
  FATHOM_LANE_FUNCTION void forget();
  /// Drops the last substep's impulses.
  FATHOM_LANE_FUNCTION void let_go();

  /// Begins the step. Anchors are in the bodies' axes; `is_b`: the link's body is the joint's B; `pull` as in
  /// BallJointRow, of the body relative to the parent. `contacts`: the mechanism solves contacts, which may have
  /// pressed on limits in the last substep.
  FATHOM_LANE_FUNCTION void begin(const GenericJointDefinition<Real>& joint, bool is_b, const LinkStart& body,
                                  const LinkStart& parent, const Vec3& anchor, const Vec3& parent_anchor,
                                  const Vec3& pull, const GenericImpulseOf<Real>& impulse, Mask contacts);
  /// Updates the joint's position; to be called after bodies have moved.
  FATHOM_LANE_FUNCTION void look(const LinkPair& pair);
  /// `relaxes`: after positions have moved; drives at their largest force do not act, and those with compliance only
  /// resist what changes their axis' rate.
  FATHOM_LANE_FUNCTION void begin_solution(bool relaxes) {
    relaxes_ = relaxes ? all_set : Flag{};
    released_ = relented_ = AxisNumber{};
    if (relaxes) return;
    for (int i = 0; i < axis_count; ++i) {
      if (!is_limited(i)) continue;
      const Mask acts = both(has_bit(pressed_, i), has_reached_limit(i));
      set_bit(released_, i, acts);
      limits_.at_limit[i] = flag(either(is_at_limit(i), acts));
    }
  }
  /// Whether its locked rotations turn in a substep by no more than `ahead_` can tell: a wheel that contacts have spun
  /// about a locked axis by a whole turn per substep would seem to hold still.
  FATHOM_LANE_FUNCTION Mask turns_slowly(const LinkPair& pair, Real h) const {
    Mask all_do = is_set(all_set);
    for (int i = translations; i < axis_count; ++i)
      if (is_locked(i)) all_do = both(all_do, h * abs(rate(i, pair)) <= max_drift);
    return all_do;
  }
  /// Chooses coordinates by the held axes, and sets the drives' impulses. Returns whether the elimination has to be
  /// repeated.
  FATHOM_LANE_FUNCTION Mask choose_coordinates(const LinkPair& pair);
  /// Whether the gap between its anchors is wide: beyond `torn_share` of the arms (`LinkSolver::set_closing`).
  FATHOM_LANE_FUNCTION Mask has_wide_gap() const {
    Real gap{};  // squared
    for (int i = 0; i < translations; ++i) {
      if (!is_locked(i) && !is_limited(i)) continue;
      const Real beyond = max(max(value_[i] - axis(i).upper, axis(i).lower - value_[i]), Real{});
      gap = fma(beyond, beyond, gap);
    }
    const Real narrow = torn_share * reach();
    return gap > narrow * narrow;
  }
  /// Eliminates the body with all that hangs on it.
  FATHOM_LANE_FUNCTION void eliminate(const TreeInertia& body) { link_ = eliminated(body, arm(), freedom_); }
  /// Adds what the parent feels of it.
  FATHOM_LANE_FUNCTION void add_to(TreeInertia& parent) const { add_child(parent, link_, freedom_, parent_arm()); }
  /// Stiffness of a taut rope or rod against swinging its ends across it: momentum per velocity of the ends (kg) within
  /// a substep of length h, h² F / L under the tension F; `pull`: the joint's impulse h F on the body.
  FATHOM_LANE_FUNCTION Real tension_stiffness(Vec3 pull, Real h) const;
  /// Response of the body, with all that hangs on it, to a push across the rope or rod (1/kg).
  FATHOM_LANE_FUNCTION Real response_across_rope() const { return max(link_.inverse[1], link_.inverse[2]); }
  /// Evaluates the tension's push across the rope at the substep's end.
  FATHOM_LANE_FUNCTION void stiffen_rope(const LinkPair& pair, Vec3 pull, Real h);
  /// Response of the body, with all that hangs on it, to turning across `axis` in the free coordinates (1/(kg·m²)).
  FATHOM_LANE_FUNCTION Real response_across(Vec3 axis) const;
  /// Sets a round's errors (m/s and rad/s) so that held axes reach their wanted value within h, gaps closing at `most`
  /// (m/s or rad/s) at the fastest …
  FATHOM_LANE_FUNCTION void aim_ahead(const LinkPair& pair, Real most, Real h);
  /// Whether these errors are within `share` (of the arms, or rad), by the measure of `meets`.
  FATHOM_LANE_FUNCTION Mask is_aimed_within(Real share, Real h) const;
  /// … or so that they lose their velocity and this share of their gap.
  FATHOM_LANE_FUNCTION void aim_at_rest(const LinkPair& pair, Real gap_share, Real min_share, Real most, Real h);
  /// The part of the body's load that the parent gets, both about the joint. `is_aimed`: errors are removed.
  FATHOM_LANE_FUNCTION TreeLoad hand_on(const TreeLoad& load, bool is_aimed);
  /// The body's change where its parent changes by `parent`. `counts`: the joint's impulse is accumulated.
  FATHOM_LANE_FUNCTION TreeChange follow(const TreeChange& parent, bool is_aimed, Mask counts);

  /// Activates or releases limits and largest forces according to the rounds' result, where `asks`. True where
  /// something changes. An axis' limit lets go once per solution, and so does a largest force: two axes whose changes
  /// undo each other's would go on without end, and so would a limit whose rounds do not end where the first one does.
  FATHOM_LANE_FUNCTION Mask revise(const LinkPair& pair, Real h, Mask asks);
  /// Notes which limits the mechanism's contacts press on, after they have been solved; none without `contacts`. Joints
  /// alone would let such a limit go in the next substep, because the contacts' sweep turns the light link back, and
  /// then the contacts press the axis past it. So it acts throughout that substep, and as long as it presses.
  FATHOM_LANE_FUNCTION void note_pressed(const LinkPair& pair, Real h, Mask contacts);
  /// Whether a drive exceeds its largest force according to the rounds' result. `motors_only`: friction, which drives
  /// nothing, may exceed its own.
  FATHOM_LANE_FUNCTION Mask overdrives(const LinkPair& pair, bool motors_only) const;
  /// Puts those drives at their largest force, which they keep in this solution. True where there is one.
  FATHOM_LANE_FUNCTION Mask restrain(const LinkPair& pair, bool motors_only);
  /// Whether held axes will be within `share` (of the arms, or rad) of the rounds' aim.
  FATHOM_LANE_FUNCTION Mask meets(const LinkPair& pair, Real share, Real h);
  FATHOM_LANE_FUNCTION void take_back();
  FATHOM_LANE_FUNCTION LinkLimits& limits() { return limits_; }
  /// Sets where the substep will leave the axes at the bodies' current motion.
  FATHOM_FLATTEN FATHOM_LANE_FUNCTION void look_ahead(const LinkPair& pair, Real h);
  FATHOM_LANE_FUNCTION const JointVector& ahead() const { return ahead_; }
  /// The same as found before at the same motion.
  FATHOM_LANE_FUNCTION void know_ahead(const JointVector& ahead) {
    for (int i = 0; i < axis_count; ++i) ahead_[i] = ahead[i];
    knows_ahead_ = all_set;
  }
  FATHOM_LANE_FUNCTION Vec3 force_more() const { return force_more_; }
  FATHOM_LANE_FUNCTION Vec3 torque_more() const { return torque_more_; }
  /// Adopts the rounds' impulses; `ends`: the substep is over.
  FATHOM_LANE_FUNCTION void apply(const LinkPair& pair, bool ends);
  /// What outlasts the step.
  FATHOM_LANE_FUNCTION GenericImpulseOf<Real> impulse() const;

 protected:
  FATHOM_LANE_FUNCTION static AxisNumber no_axis() { return AxisNumber{} - 1; }

  FATHOM_LANE_FUNCTION bool is_b() const { return everywhere(is_set(is_b_)); }
  FATHOM_LANE_FUNCTION bool relaxes() const { return everywhere(is_set(relaxes_)); }
  FATHOM_LANE_FUNCTION bool is_distance() const { return first_lane(row_.distance) != 0; }
  FATHOM_LANE_FUNCTION bool reacts() const { return everywhere(is_set(reacts_)); }
  FATHOM_LANE_FUNCTION float sign() const { return is_b() ? 1.0f : -1.0f; }
  FATHOM_LANE_FUNCTION const GenericAxis<Real>& axis(int i) const { return row_.axes[i]; }
  FATHOM_LANE_FUNCTION bool is_locked(int i) const { return first_lane(axis(i).locked) != 0; }
  FATHOM_LANE_FUNCTION bool is_limited(int i) const { return first_lane(axis(i).limited) != 0; }
  FATHOM_LANE_FUNCTION bool is_driven(int i) const { return !relaxes() && first_lane(axis(i).most) > 0; }
  FATHOM_LANE_FUNCTION bool may_drive(int i) const {
    return first_lane(axis(i).most) > 0 || first_lane(axis(i).armature) > 0;
  }
  FATHOM_LANE_FUNCTION Mask is_at_limit(int i) const { return is_set(limits_.at_limit[i]); }
  FATHOM_LANE_FUNCTION Mask is_at_upper(int i) const { return is_set(limits_.at_upper[i]); }
  FATHOM_LANE_FUNCTION Mask is_at_most(int i) const { return is_set(limits_.at_most[i]); }
  FATHOM_LANE_FUNCTION Mask is_at_minus(int i) const { return is_set(limits_.at_minus[i]); }
  /// A drive without compliance, which gives whatever impulse its velocity takes. It holds the axis in relaxing
  /// solutions, too: otherwise a contact that presses on the axis would find it locked and free in turn, and what lies
  /// on a lift ten times as heavy as the lift itself would tremble without end.
  FATHOM_LANE_FUNCTION Mask is_rigid_drive(int i) const {
    if (!(first_lane(axis(i).most) > 0)) return is_set(Flag{});
    return inverted(either(is_at_most(i), axis(i).compliance > 0.0f));
  }
  FATHOM_LANE_FUNCTION Mask is_held(int i) const {
    return is_locked(i) ? is_set(all_set) : either(is_at_limit(i), is_rigid_drive(i));
  }
  /// The position of a locked axis, or of the limit that acts or would act.
  FATHOM_LANE_FUNCTION Real bound(int i) const {
    const GenericAxis<Real>& a = axis(i);
    const Mask is_upper =
        either(both(is_at_limit(i), is_at_upper(i)), both(inverted(is_at_limit(i)), value_[i] > a.upper));
    return select(is_upper, a.upper, a.lower);
  }
  FATHOM_LANE_FUNCTION Real drive_aim(int i) const;
  /// m, the length by which gaps are judged.
  FATHOM_LANE_FUNCTION Real reach() const {
    const Real arms = length(row_.arm_a) + length(row_.arm_b);
    return is_distance() ? arms + value_[0] : arms;
  }
  /// Armature's impulse (N·s or N·m·s) where the axis gets the rate `to`.
  FATHOM_LANE_FUNCTION Real of_armature(int i, Real to) const { return axis(i).armature * (rate_[i] - to); }
  /// Stiffness of a drive with compliance in a relaxing solution, which it meets as the impulse that changes the rate
  /// that the positions have moved with. If it let go there, a servo that is stiffer than the link it moves would hold
  /// a robot on its leg while positions move, and the leg alone would lose what a contact pushed out: the robot hops.
  FATHOM_LANE_FUNCTION Real relaxed_stiffness(int i) const {
    const GenericAxis<Real>& a = axis(i);
    const Mask acts = both(a.compliance > 0.0f, inverted(is_at_most(i)));
    return select(both(is_set(relaxes_), acts), 1.0f / a.compliance, Real{});
  }
  FATHOM_LANE_FUNCTION bool keeps_rate(int i) const {
    return reacts() || (first_lane(axis(i).most) > 0 && anywhere(axis(i).compliance > 0.0f));
  }
  /// N·s or N·m·s on B, of these in world axes; `has`: the axis has a coordinate.
  struct OfAxis {
    Mask has;
    Real impulse;
  };
  FATHOM_LANE_FUNCTION OfAxis part_of(int i, const Vec3& force, const Vec3& torque) const;
  FATHOM_LANE_FUNCTION void note_hit(int i, Mask hits);
  /// The value that a held axis is to have at the substep's end: its bound, or as near as `most` (m/s or rad/s) allows
  /// within the substep. A limit lets the joint approach at any speed; one that the joint has left may still count as
  /// acting and must not pull it back at once.
  FATHOM_LANE_FUNCTION Real wanted_value(int i, const LinkPair& pair, Real most, Real h) const;
  /// The rate that closes an axis' gap to its bound, at most this share of the gap.
  FATHOM_LANE_FUNCTION Real closing_rate(int i, Real rate, Real gap_share, Real min_share, Real most, Real h) const;
  FATHOM_LANE_FUNCTION Real rate(int i, const LinkPair& pair) const;
  /// Adds axis i as a coordinate where it `belongs`; `count`: number of rotations so far.
  FATHOM_LANE_FUNCTION void add_rotation(int i, Mask belongs, bool is_free, AxisNumber& count);
  FATHOM_LANE_FUNCTION void set_drives(const LinkPair& pair);
  FATHOM_LANE_FUNCTION void set_errors(const JointVector& of_axes);
  FATHOM_LANE_FUNCTION static Mask has_bit(AxisNumber bits, int i) { return inverted((bits & (1 << i)) == 0); }
  FATHOM_LANE_FUNCTION static void set_bit(AxisNumber& bits, int i, Mask where) {
    bits = select(where, bits | (1 << i), bits);
  }
  /// `ahead`: where the substep leaves the axis, according to the rounds.
  FATHOM_LANE_FUNCTION Mask revise_limit(int i, Mask asks, Real ahead, Real given, Real after);
  /// Whether a drive at its largest force moves its axis past its aim, so that it will give less.
  FATHOM_LANE_FUNCTION Mask overshoots(int i, Real after) const;
  FATHOM_LANE_FUNCTION Mask revise_drive(int i, Mask asks, Real given, Real after);
  /// Whether an axis that ends at `ahead` is within its limits, or as near as they bring it.
  FATHOM_LANE_FUNCTION Mask is_within(int i, Real ahead, Real slack) const {
    return both(ahead >= min(axis(i).lower, aim_[i]) - slack, ahead <= max(axis(i).upper, aim_[i]) + slack);
  }
  FATHOM_LANE_FUNCTION Real slack_of(int i) const {
    return i < translations ? limit_slack * reach() : splat<Real>(limit_slack);
  }
  /// Whether the axis is where its limit acts, or nearly.
  FATHOM_LANE_FUNCTION Mask has_reached_limit(int i) const {
    const Real beyond = select(is_at_upper(i), value_[i] - axis(i).upper, axis(i).lower - value_[i]);
    return beyond >= -slack_of(i);
  }
  /// The impulse that the axis' drive would give by itself.
  FATHOM_LANE_FUNCTION Real drive_impulse(int i, Real after) const;
  /// Whether an axis at its limit is pressed against it; `held`: the limit's impulse.
  FATHOM_LANE_FUNCTION Mask presses(int i, Real held) const {
    return is_set(select(is_at_upper(i), flag(held <= 0.0f), flag(held >= 0.0f)));
  }
  /// Whether a drive exceeds its largest force with the impulse `given`.
  FATHOM_LANE_FUNCTION Mask exceeds_most(int i, Real given) const {
    return inverted(either(is_at_most(i), abs(given) <= (1 + drive_slack) * axis(i).most));
  }
  FATHOM_LANE_FUNCTION Mask is_friction(int i) const {
    const GenericAxis<Real>& a = axis(i);
    return both(a.velocity == 0.0f, both(a.approach == 0.0f, inverted(a.compliance > 0.0f)));
  }
  /// Calls `act(i, has, given)` for the axes whose drive acts where it `has` a coordinate and no limit holds it;
  /// `given`: its impulse.
  template <class Act>
  FATHOM_LANE_FUNCTION void each_drive(const LinkPair& pair, bool motors_only, const Act& act) const;

  // Only words as long as a Real: lanes are separated word by word. First what `begin` sets; solutions set the rest.
  Flag is_b_{}, reacts_{}, moves_{};  // same in all lanes
  GenericJointPlace<Real> row_{};
  Vec3 along_[3], about_[3];  // of the axes, current
  Vec3 reach_a_, arm_b_;
  JointVector value_{}, rate_{};  // rate_: m/s or rad/s, after the last solution
  LinkLimits limits_{};
  Vec3 force_, torque_;
  Flag relaxes_{}, is_first_round_{}, knows_ahead_{}, aims_ahead_{};  // same in all lanes
  JointVector ahead_{}, aim_{};  // aim_: of locked or limited axes, the position that holding them leads to
  JointFreedom freedom_;
  AxisNumber axis_of_[joint_coordinates] = {};  // of a coordinate, or no_axis; for translations the same in all lanes
  JointVector scale_{};                         // the axis' rate per unit rate of the coordinate
  JointVector drive_{}, error_{};
  EliminatedLink link_{};
  JointLoad load_{};
  // A bit per axis: its limit, its largest force has let go in this solution; see `note_pressed`.
  AxisNumber released_{}, relented_{}, pressed_{};
  Vec3 force_more_, torque_more_, force_sum_, torque_sum_;
};

FATHOM_LANE_FUNCTION void JointLink::begin(const GenericJointDefinition<Real>& joint, bool is_b, const LinkStart& body,
                                           const LinkStart& parent, const Vec3& anchor, const Vec3& parent_anchor,
                                           const Vec3& pull, const GenericImpulseOf<Real>& impulse, Mask contacts) {
  new (this) JointLink;  // assigned, its many lanes would be cleared elsewhere and copied
  is_b_ = flag(is_b ? is_set(all_set) : is_set(Flag{}));
  const LinkStart &a = is_b ? parent : body, &b = is_b ? body : parent;
  place_generic_joint(a.rotation, b.rotation, b.position - a.position, joint.on_a, joint.on_b,
                      is_b ? parent_anchor : anchor, is_b ? anchor : parent_anchor, row_);
  row_.pull = is_b ? pull : -pull;
  row_.distance = joint.distance, row_.cone = joint.cone, row_.min_hit = joint.min_hit;
  for (int i = 0; i < axis_count; ++i) row_.axes[i] = joint.axes[i];
  reacts_ = flag(inverted(joint.reacts == 0.0f)), moves_ = flag(inverted(joint.moves == 0.0f));
  const LinkMotion of_body = LinkMotion::at_start(body.linear, body.angular);
  const LinkMotion of_parent = LinkMotion::at_start(parent.linear, parent.angular);
  const LinkPair pair{of_body, of_parent};
  look(pair);
  for (int i = 0; reacts() && i < axis_count; ++i) rate_[i] = rate(i, pair);
  for (int i = 0; i < axis_count; ++i) {
    const Real total = sign() * (impulse.hold[i] + impulse.drive[i]);
    if (i < translations)
      force_ = mul_add(force_, total, along_[i]);
    else
      torque_ = mul_add(torque_, total, about_[i - translations]);
    if (!is_limited(i)) continue;
    limits_.at_limit[i] = flag(inverted(impulse.hold[i] == 0.0f));
    limits_.at_upper[i] = flag(impulse.hold[i] < 0.0f);
    set_bit(pressed_, i, both(contacts, is_at_limit(i)));
  }
}

FATHOM_LANE_FUNCTION void JointLink::let_go() { force_ = torque_ = {}; }
FATHOM_LANE_FUNCTION void JointLink::forget() {
  force_ = torque_ = force_sum_ = torque_sum_ = {};
  for (int i = 0; i < axis_count; ++i) limits_.at_limit[i] = limits_.at_most[i] = Flag{};
}
FATHOM_LANE_FUNCTION void JointLink::take_back() {
  force_more_ = torque_more_ = {};
  is_first_round_ = all_set, knows_ahead_ = Flag{};
}

FATHOM_LANE_FUNCTION void JointLink::look(const LinkPair& pair) {
  const LinkMotion &a = is_b() ? pair.parent : pair.body, &b = is_b() ? pair.body : pair.parent;
  PlacedBodies bodies{};
  bodies.a.moved = a.moved, bodies.b.moved = b.moved;
  const GenericJointRows<Real, PlacedBodies> rows(row_, bodies, a.rotation, b.rotation);
  for (int i = 0; i < axis_count; ++i) {
    value_[i] = rows.value[i];
    if (i < translations) along_[i] = rows.along[i], about_[i] = rows.torque_axis(i);
  }
  reach_a_ = rows.reach(), arm_b_ = rows.arm();
}

// --- coordinates -----------------------------------------------------------------------------------------------

FATHOM_LANE_FUNCTION void JointLink::add_rotation(int i, Mask belongs, bool is_free, AxisNumber& count) {
  if (!anywhere(belongs)) return;
  Vec3 across = about_[i - translations];
  for (int k = 0; k < 2; ++k) {
    const Mask is_before = both(belongs, count > k);
    if (anywhere(is_before))
      across = select(is_before, across - dot(across, freedom_.about[k]) * freedom_.about[k], across);
  }
  const Real size = length(across);
  const Mask counts = both(belongs, inverted(size < min_axis_across));
  const Vec3 direction = (1.0f / size) * across;
  for (int k = 0; k < 3; ++k) {
    const Mask is_here = both(counts, count == k);
    if (!anywhere(is_here)) continue;
    const int coordinate = translations + k;
    freedom_.about[k] = select(is_here, direction, freedom_.about[k]);
    axis_of_[coordinate] = select(is_here, AxisNumber{} + i, axis_of_[coordinate]);
    scale_[coordinate] = select(is_here, size, scale_[coordinate]);
    if (is_free) freedom_.is_free[coordinate] = flag(either(freedom_.has(coordinate), is_here));
  }
  count = select(counts, count + 1, count);
}

FATHOM_LANE_FUNCTION Vec3 any_across(Vec3 a) {
  return normalize(cross(a, select(abs(a.x) < 0.5f, unit_vector(1, 0, 0), unit_vector(0, 1, 0))));
}

FATHOM_LANE_FUNCTION Real JointLink::drive_aim(int i) const {
  const GenericAxis<Real>& a = axis(i);
  Real off = a.target - value_[i];
  if (i == translations) off = select(off > pi, off - 2 * pi, select(off < -pi, off + 2 * pi, off));
  return fma(a.approach, off, a.velocity);
}

FATHOM_LANE_FUNCTION Mask JointLink::choose_coordinates(const LinkPair& pair) {
  const JointFreedom last = freedom_;
  freedom_ = {};
  take_back();
  for (int k = 0; k < translations; ++k) {
    freedom_.along[k] = along_[k];
    axis_of_[k] = AxisNumber{} + k, scale_[k] = splat<Real>(1);
    freedom_.is_free[k] = flag(inverted(is_held(k)));
  }
  if (is_distance()) {
    // Coincident anchors define no line, and nothing acts along it.
    const Mask meet = length_squared(along_[0]) == 0.0f;
    freedom_.along[0] = select(meet, unit_vector(1, 0, 0), freedom_.along[0]);
    axis_of_[0] = select(meet, no_axis(), axis_of_[0]);
    freedom_.is_free[0] = flag(either(freedom_.has(0), meet));
    freedom_.along[1] = any_across(freedom_.along[0]);
    freedom_.along[2] = cross(freedom_.along[0], freedom_.along[1]);
    axis_of_[1] = axis_of_[2] = no_axis();
  }
  AxisNumber count{};
  for (int i = translations; i < axis_count; ++i) add_rotation(i, is_held(i), false, count);
  for (int i = translations; i < axis_count; ++i)
    if (may_drive(i)) add_rotation(i, inverted(is_held(i)), true, count);
  for (int k = 0; k < translations; ++k) {
    const Mask is_left = inverted(count > k);
    if (!anywhere(is_left)) continue;
    const Vec3 direction = k == 0   ? unit_vector(1, 0, 0)
                           : k == 1 ? any_across(freedom_.about[0])
                                    : cross(freedom_.about[0], freedom_.about[1]);
    freedom_.about[k] = select(is_left, direction, freedom_.about[k]);
    axis_of_[translations + k] = select(is_left, no_axis(), axis_of_[translations + k]);
    freedom_.is_free[translations + k] = flag(either(freedom_.has(translations + k), is_left));
  }
  set_drives(pair);
  return inverted(freedom_.is_same(last));
}

/// Impulses of free coordinates before any change: those of their drives, and of armatures, which keep the old rates.
/// Nothing else acts on a free coordinate, so it gives back the impulse it had before it was free.
FATHOM_LANE_FUNCTION void JointLink::set_drives(const LinkPair& pair) {
  JointVector before;
  to_coordinates(freedom_, force_, torque_, before);
  for (int k = 0; k < joint_coordinates; ++k) {
    drive_[k] = error_[k] = Real{};
    if (!relaxes()) drive_[k] = select(freedom_.has(k), -before[k], Real{});
  }
  for (int i = 0; i < axis_count; ++i) {
    if (!may_drive(i)) continue;
    const Real now = rate(i, pair);
    Real elastic{}, given{};  // the drive's stiffness and impulse, in the axis' direction
    const bool acts = first_lane(axis(i).most) > 0;
    if (is_driven(i)) {
      const Real stiffness = 1.0f / axis(i).compliance;
      const Mask most = is_at_most(i);
      elastic = select(most, Real{}, stiffness);
      given = select(most, select(is_at_minus(i), -axis(i).most, axis(i).most), stiffness * (drive_aim(i) - now));
    } else if (acts) {
      elastic = relaxed_stiffness(i);
      given = elastic * (rate_[i] - now);
    }
    for (int k = i < translations ? i : translations; k < (i < translations ? i + 1 : joint_coordinates); ++k) {
      const Mask is_here = both(freedom_.has(k), axis_of_[k] == i);
      if (!anywhere(is_here)) continue;
      const Real scale = scale_[k];
      if (reacts()) {
        freedom_.stiffness[k] =
            select(is_here, fma(scale * scale, axis(i).armature, freedom_.stiffness[k]), freedom_.stiffness[k]);
        drive_[k] = select(is_here, fma(sign() * scale, of_armature(i, now), drive_[k]), drive_[k]);
      }
      if (!acts) continue;
      freedom_.stiffness[k] =
          select(is_here, fma(scale * scale, elastic, freedom_.stiffness[k]), freedom_.stiffness[k]);
      drive_[k] = select(is_here, fma(sign() * scale, given, drive_[k]), drive_[k]);
    }
  }
}

FATHOM_LANE_FUNCTION Real JointLink::tension_stiffness(Vec3 pull, Real h) const {
  if (!is_distance()) return Real{};
  const Real impulse = max(-sign() * dot(along_[0], pull), Real{});
  const Real stiffness = h * impulse / max(value_[0], 1e-3f * reach());
  return select(impulse > 0.0f, min(stiffness, splat<Real>(1e30f)), Real{});  // finite, whatever the length
}

FATHOM_LANE_FUNCTION void JointLink::stiffen_rope(const LinkPair& pair, Vec3 pull, Real h) {
  if (!is_distance()) return;
  const Real stiffness = tension_stiffness(pull, h);
  const Vec3 apart = (pair.body.linear + cross(pair.body.angular, arm())) -
                     (pair.parent.linear + cross(pair.parent.angular, parent_arm()));
  for (int k = 1; k < translations; ++k) {
    freedom_.stiffness[k] = freedom_.stiffness[k] + stiffness;
    drive_[k] = fma(-stiffness, dot(freedom_.along[k], apart), drive_[k]);
  }
}

FATHOM_LANE_FUNCTION Real JointLink::response_across(Vec3 axis) const {
  Real sum{};
  for (int k = 0; k < 3; ++k) {
    const Real along = dot(freedom_.about[k], axis);
    sum = fma(link_.inverse[translations + k], fma(-along, along, splat<Real>(1)), sum);
  }
  return sum;
}

// --- rounds ----------------------------------------------------------------------------------------------------

FATHOM_LANE_FUNCTION Real JointLink::rate(int i, const LinkPair& pair) const {
  const LinkMotion &a = is_b() ? pair.parent : pair.body, &b = is_b() ? pair.body : pair.parent;
  if (i >= translations) return dot(about_[i - translations], b.angular - a.angular);
  return dot(along_[i], (b.linear + cross(b.angular, arm_b_)) - (a.linear + cross(a.angular, reach_a_)));
}

FATHOM_LANE_FUNCTION void JointLink::look_ahead(const LinkPair& pair, Real h) {
  if (everywhere(is_set(knows_ahead_))) return;
  knows_ahead_ = all_set;
  const LinkMotion &a = is_b() ? pair.parent : pair.body, &b = is_b() ? pair.body : pair.parent;
  PlacedBodies bodies{};
  bodies.a.moved = mul_add(a.moved, h, a.linear), bodies.b.moved = mul_add(b.moved, h, b.linear);
  const GenericJointRows<Real, PlacedBodies> rows(row_, bodies, a.ahead, b.ahead);
  for (int i = 0; i < axis_count; ++i) {
    ahead_[i] = rows.value[i];
    if (i < translations) ahead_[i] = fma(-0.5f * h * h, dot(rows.along[i], row_.pull), ahead_[i]);
  }
}

FATHOM_LANE_FUNCTION Real JointLink::wanted_value(int i, const LinkPair& pair, Real most, Real h) const {
  const Real off = bound(i) - value_[i];
  if (is_limited(i)) {
    const Real now = rate(i, pair);
    most = max(most, select(off > 0.0f, now, -now));
  }
  return value_[i] + clamp(off, -most * h, most * h);
}

FATHOM_LANE_FUNCTION Real JointLink::closing_rate(int i, Real rate, Real gap_share, Real min_share, Real most,
                                                  Real h) const {
  Real least = min_share / h;
  // A rope's own length does not count: pulled by a hundredth of it, a body on short arms would be spun up.
  if (i < translations) least = least * (length(row_.arm_a) + length(row_.arm_b));
  const Real pull = min(most, abs(rate) + least);
  return clamp(gap_share / h * (value_[i] - bound(i)), -pull, pull);
}

/// Errors of held axes, in the order of the coordinates.
FATHOM_LANE_FUNCTION void JointLink::set_errors(const JointVector& of_axes) {
  for (int k = 0; k < joint_coordinates; ++k) {
    const Mask is_held = inverted(freedom_.has(k));
    if (!anywhere(is_held)) continue;
    Real error = of_axes[k];
    if (k >= translations) {
      Vec3 about = about_[0];
      error = of_axes[translations];
      for (int i = 1; i < translations; ++i) {
        const Mask is_this = axis_of_[k] == translations + i;
        about = select(is_this, about_[i], about);
        error = select(is_this, of_axes[translations + i], error);
      }
      error = sign() * error;
      for (int m = translations; m < k; ++m)
        error = fma(-dot(about, freedom_.about[m - translations]), error_[m], error);
    } else {
      error = sign() * error;
    }
    error_[k] = select(is_held, error / scale_[k], error_[k]);
  }
}

FATHOM_LANE_FUNCTION void JointLink::aim_ahead(const LinkPair& pair, Real most, Real h) {
  JointVector errors{};
  look_ahead(pair, h);
  aims_ahead_ = all_set;
  const bool begins = everywhere(is_set(is_first_round_));
  for (int i = 0; i < axis_count; ++i) {
    const bool may_be_held = is_locked(i) || is_limited(i);
    if (begins && may_be_held) aim_[i] = wanted_value(i, pair, most, h);
    if (may_be_held) errors[i] = (ahead_[i] - aim_[i]) / h;
    if (is_driven(i) && !is_locked(i)) errors[i] = select(is_at_limit(i), errors[i], rate(i, pair) - drive_aim(i));
  }
  set_errors(errors);
}

FATHOM_LANE_FUNCTION Mask JointLink::is_aimed_within(Real share, Real h) const {
  Mask is_within = is_set(all_set);
  const Real of_arms = share * reach();
  for (int k = 0; k < joint_coordinates; ++k)
    is_within = both(is_within, either(freedom_.has(k), h * abs(error_[k]) <= (k < translations ? of_arms : share)));
  return is_within;
}

FATHOM_LANE_FUNCTION void JointLink::aim_at_rest(const LinkPair& pair, Real gap_share, Real min_share, Real most,
                                                 Real h) {
  JointVector errors{};
  aims_ahead_ = Flag{};
  for (int i = 0; i < axis_count; ++i) {
    errors[i] = rate(i, pair);
    if (relaxes() && is_limited(i)) errors[i] = select(is_at_limit(i), errors[i] - limits_.bounce[i], errors[i]);
    const bool may_be_held = is_locked(i) || is_limited(i);
    Real held = errors[i];
    if (!relaxes() && may_be_held) {
      const Real closing = closing_rate(i, errors[i], gap_share, min_share, most, h);
      aim_[i] = fma(-h, closing, value_[i]);
      held = held + closing;
      if (i < translations) held = fma(-0.5f * h, dot(along_[i], row_.pull), held);
    }
    if (is_locked(i))
      errors[i] = held;
    else
      errors[i] = select(is_at_limit(i), held, errors[i] - drive_aim(i));
  }
  set_errors(errors);
}

FATHOM_LANE_FUNCTION TreeLoad JointLink::hand_on(const TreeLoad& load, bool is_aimed) {
  const JointVector nothing{}, &drive = drive_, &error = error_;
  // Drives act in the first round.
  const bool drives = is_aimed && everywhere(is_set(is_first_round_));
  load_ = eliminated_load(link_, freedom_, load, drives ? drive : nothing);
  if (is_aimed) is_first_round_ = Flag{};
  return handed_on(link_, freedom_, load_, is_aimed ? error : nothing);
}

FATHOM_LANE_FUNCTION TreeChange JointLink::follow(const TreeChange& parent, bool is_aimed, Mask counts) {
  const JointVector nothing{}, &error = error_;
  JointVector of_parent, change, impulse;
  knows_ahead_ = Flag{};
  to_coordinates(freedom_, parent.linear + cross(parent.angular, parent_arm()), parent.angular, of_parent);
  follow_at_joint(link_, freedom_, load_, is_aimed ? error : nothing, of_parent, change, impulse);
  if (anywhere(counts)) {
    force_more_ = select(counts, force_more_ + linear_of(freedom_, impulse), force_more_);
    torque_more_ = select(counts, torque_more_ + angular_of(freedom_, impulse), torque_more_);
  }
  const Vec3 angular = angular_of(freedom_, change);
  return {linear_of(freedom_, change) + cross(arm(), angular), angular};
}

// --- what rounds have found ------------------------------------------------------------------------------------

FATHOM_LANE_FUNCTION JointLink::OfAxis JointLink::part_of(int i, const Vec3& force, const Vec3& torque) const {
  if (i < translations) return {axis_of_[i] == i, sign() * dot(freedom_.along[i], force) / scale_[i]};
  OfAxis found{is_set(Flag{}), Real{}};
  for (int k = 0; k < translations; ++k) {
    const Mask is_here = axis_of_[translations + k] == i;
    if (!anywhere(is_here)) continue;
    found.has = either(found.has, is_here);
    found.impulse = select(is_here, sign() * dot(freedom_.about[k], torque) / scale_[translations + k], found.impulse);
  }
  return found;
}

FATHOM_LANE_FUNCTION Mask JointLink::revise_limit(int i, Mask asks, Real ahead, Real given, Real after) {
  const GenericAxis<Real>& a = axis(i);
  const Mask was_at_limit = is_at_limit(i);
  // An axis that returns from beyond its limit by itself, as fast as the limit would move it, is left alone.
  const Mask was_released = has_bit(released_, i);
  const Mask is_free = is_within(i, ahead, select(was_released, slack_of(i), Real{}));
  // A strong drive that a limit has just let go would cross the whole range, until it is found to give less.
  const Mask waits = is_driven(i) ? both(was_released, overshoots(i, after)) : is_set(Flag{});
  const Mask hits = both(asks, inverted(either(was_at_limit, either(is_free, waits))));
  const Real drive = drive_impulse(i, after), held = given - drive - of_armature(i, after);
  const Mask leaves = both(both(asks, inverted(was_released)), both(was_at_limit, inverted(presses(i, held))));
  set_bit(released_, i, leaves);
  limits_.at_limit[i] = flag(both(either(was_at_limit, hits), inverted(leaves)));
  limits_.at_upper[i] = select(hits, flag(ahead > a.upper), limits_.at_upper[i]);
  limits_.at_most[i] = flag(both(is_at_most(i), inverted(hits)));
  note_hit(i, hits);
  limits_.bounce[i] = select(leaves, Real{}, limits_.bounce[i]);
  if (is_driven(i)) {
    const Mask gives_most = both(leaves, abs(drive) == a.most);
    limits_.at_most[i] = flag(either(is_at_most(i), gives_most));
    limits_.at_minus[i] = select(gives_most, flag(drive < 0.0f), limits_.at_minus[i]);
  }
  return either(hits, leaves);
}

FATHOM_LANE_FUNCTION Real JointLink::drive_impulse(int i, Real after) const {
  if (!is_driven(i)) return Real{};
  const Real most = axis(i).most, push = drive_aim(i) - after;
  return select(axis(i).compliance > 0.0f, clamp(push / axis(i).compliance, -most, most),
                select(push < 0.0f, -most, most));
}

FATHOM_LANE_FUNCTION void JointLink::note_pressed(const LinkPair& pair, Real h, Mask contacts) {
  pressed_ = AxisNumber{};
  if (!everywhere(is_set(moves_)) || !anywhere(contacts)) return;
  for (int i = 0; i < axis_count; ++i) {
    if (!is_limited(i)) continue;
    const OfAxis now = part_of(i, force_ + force_more_, torque_ + torque_more_);
    const Real after = rate(i, pair), ahead = fma(h, after, value_[i]);
    const Real held = now.impulse - drive_impulse(i, after) - of_armature(i, after);
    const Mask stays = both(now.has, both(is_at_limit(i), presses(i, held)));
    Mask may_begin = inverted(is_at_limit(i));
    if (i >= translations && may_drive(i)) may_begin = both(may_begin, now.has);
    const Mask begins = both(may_begin, inverted(is_within(i, ahead, slack_of(i))));
    set_bit(pressed_, i, both(contacts, either(stays, begins)));
    limits_.at_upper[i] = select(begins, flag(ahead > axis(i).upper), limits_.at_upper[i]);
  }
}

FATHOM_LANE_FUNCTION void JointLink::note_hit(int i, Mask hits) {
  if (!reacts()) return;
  const Real speed = select(is_at_upper(i), rate_[i], -rate_[i]);
  const Real bounce = select(speed > row_.min_hit, -axis(i).restitution * rate_[i], Real{});
  limits_.bounce[i] = select(hits, bounce, limits_.bounce[i]);
}

FATHOM_LANE_FUNCTION Mask JointLink::overshoots(int i, Real after) const {
  const GenericAxis<Real>& a = axis(i);
  const Real short_by = select(is_at_minus(i), after - drive_aim(i), drive_aim(i) - after);
  const Mask may_relent = both(is_at_most(i), inverted(has_bit(relented_, i)));
  return both(may_relent, inverted(short_by >= (1 - drive_slack) * a.most * a.compliance));
}

FATHOM_LANE_FUNCTION Mask JointLink::revise_drive(int i, Mask asks, Real given, Real after) {
  const Mask was_at_most = is_at_most(i);
  const Mask exceeds = both(asks, exceeds_most(i, given));
  const Mask suffices = both(asks, overshoots(i, after));
  set_bit(relented_, i, suffices);
  limits_.at_minus[i] = select(exceeds, flag(given < 0.0f), limits_.at_minus[i]);
  limits_.at_most[i] = flag(both(either(was_at_most, exceeds), inverted(suffices)));
  return either(exceeds, suffices);
}

FATHOM_LANE_FUNCTION Mask JointLink::revise(const LinkPair& pair, Real h, Mask asks) {
  Mask changes = is_set(Flag{});
  if (!everywhere(is_set(moves_))) return changes;
  const bool looks_ahead = everywhere(is_set(aims_ahead_));
  if (looks_ahead) look_ahead(pair, h);
  for (int i = 0; i < axis_count; ++i) {
    if (!is_limited(i) && !is_driven(i)) continue;
    const OfAxis now = part_of(i, force_ + force_more_, torque_ + torque_more_);
    const Real after = rate(i, pair);
    Mask changes_limit = is_set(Flag{});
    if (is_limited(i)) {
      // Axes without a coordinate are not held by anything.
      Mask may_change = now.has;
      if (i >= translations && !may_drive(i)) may_change = either(may_change, inverted(is_at_limit(i)));
      const Real ahead = looks_ahead ? ahead_[i] : fma(h, after, value_[i]);
      changes_limit = revise_limit(i, both(asks, may_change), ahead, now.impulse, after);
    }
    Mask changes_drive = is_set(Flag{});
    if (is_driven(i) && !is_locked(i))
      changes_drive = revise_drive(i, both(both(asks, now.has), inverted(either(changes_limit, is_at_limit(i)))),
                                   now.impulse - of_armature(i, after), after);
    changes = either(changes, either(changes_limit, changes_drive));
  }
  return changes;
}

template <class Act>
FATHOM_LANE_FUNCTION void JointLink::each_drive(const LinkPair& pair, bool motors_only, const Act& act) const {
  for (int i = 0; i < axis_count; ++i) {
    if (!(first_lane(axis(i).most) > 0) || is_locked(i)) continue;
    const OfAxis now = part_of(i, force_ + force_more_, torque_ + torque_more_);
    Mask acts = both(now.has, inverted(is_at_limit(i)));
    if (motors_only) acts = both(acts, inverted(is_friction(i)));
    act(i, acts, now.impulse - of_armature(i, rate(i, pair)));
  }
}

FATHOM_LANE_FUNCTION Mask JointLink::overdrives(const LinkPair& pair, bool motors_only) const {
  Mask does = is_set(Flag{});
  each_drive(pair, motors_only,
             [&](int i, Mask has, Real given) { does = either(does, both(has, exceeds_most(i, given))); });
  return does;
}

FATHOM_LANE_FUNCTION Mask JointLink::restrain(const LinkPair& pair, bool motors_only) {
  Mask changes = is_set(Flag{});
  each_drive(pair, motors_only, [&](int i, Mask has, Real given) {
    const Mask exceeds = both(has, exceeds_most(i, given));
    limits_.at_minus[i] = select(exceeds, flag(given < 0.0f), limits_.at_minus[i]);
    limits_.at_most[i] = flag(either(is_at_most(i), exceeds));
    changes = either(changes, exceeds);
  });
  return changes;
}

FATHOM_LANE_FUNCTION Mask JointLink::meets(const LinkPair& pair, Real share, Real h) {
  look_ahead(pair, h);
  Mask do_meet = is_set(all_set);
  const Real of_arms = share * reach();
  for (int i = 0; i < axis_count; ++i) {
    if (!is_locked(i) && !is_limited(i)) continue;
    const Mask is_near = abs(ahead_[i] - aim_[i]) <= (i < translations ? of_arms : share);
    do_meet = both(do_meet, is_locked(i) ? is_near : either(is_near, inverted(is_at_limit(i))));
  }
  return do_meet;
}

FATHOM_LANE_FUNCTION void JointLink::apply(const LinkPair& pair, bool ends) {
  force_ += force_more_, torque_ += torque_more_;
  for (int i = 0; i < axis_count; ++i)
    if (keeps_rate(i)) rate_[i] = rate(i, pair);
  if (!ends) return;
  force_sum_ += force_, torque_sum_ += torque_;
  for (Real& bounce : limits_.bounce) bounce = Real{};
}

FATHOM_LANE_FUNCTION GenericImpulseOf<Real> JointLink::impulse() const {
  GenericImpulseOf<Real> impulse;
  for (int i = 0; i < axis_count; ++i) {
    const OfAxis of_axis = part_of(i, force_, torque_);
    const Real total = select(of_axis.has, of_axis.impulse, Real{});
    const Mask drives = may_drive(i) ? inverted(is_at_limit(i)) : is_set(Flag{});
    const Mask holds = is_locked(i) ? is_set(all_set) : is_at_limit(i);
    impulse.drive[i] = select(drives, total, Real{});
    impulse.hold[i] = select(both(inverted(drives), holds), total, Real{});
  }
  impulse.force = sign() * force_sum_, impulse.torque = sign() * torque_sum_;
  return impulse;
}
