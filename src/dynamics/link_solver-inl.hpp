// The operations of a mechanism's links in its direct solution (dynamics/mechanism.hpp), on each link alone or together
// with its neighbours. Included like dynamics/joint_link-inl.hpp.

/// Of a unit quaternion.
FATHOM_LANE_FUNCTION Mat3 rotation_matrix(const UnitQuat<Real>& q) {
  const Real xx = q.v.x * q.v.x, yy = q.v.y * q.v.y, zz = q.v.z * q.v.z;
  const Real xy = q.v.x * q.v.y, xz = q.v.x * q.v.z, yz = q.v.y * q.v.z;
  const Real wx = q.w * q.v.x, wy = q.w * q.v.y, wz = q.w * q.v.z;
  return {{1.0f - 2.0f * (yy + zz), 2.0f * (xy + wz), 2.0f * (xz - wy)},
          {2.0f * (xy - wz), 1.0f - 2.0f * (xx + zz), 2.0f * (yz + wx)},
          {2.0f * (xz + wy), 2.0f * (yz - wx), 1.0f - 2.0f * (xx + yy)}};
}

/// What a substitution does: remove all links' errors under their loads (aimed), respond to closures' loads in addition
/// (closing), or only write the response to loads to `LinkState::step` (probing).
enum class LinkPass { aimed, closing, probing };

/// Operations on links by number. `Access` knows their bodies and the arrays of their states:
///
///     state(i): LinkState&;  generic(n): JointLink&
///     body(i, link): an object with linear, angular, moved, turned and inverse_mass, like a SolverBody
///     set_velocity(i, link, linear, angular);  add_velocity(i, link, linear, angular)
///     response(i, link): inverse inertia in the axes of the spin
///     push_out_velocity(): Real;  limits(h): its members are compared with Reals
template <class Access>
struct LinkSolver {
  static constexpr std::uint32_t none = MechanismLink::none;

  Access access;
  const MechanismLink* links;

  FATHOM_LANE_FUNCTION LinkState& state(std::uint32_t i) const { return access.state(i); }
  FATHOM_LANE_FUNCTION bool has_generic(std::uint32_t i) const { return links[i].generic != none; }
  FATHOM_LANE_FUNCTION JointLink& generic(std::uint32_t i) const { return access.generic(links[i].generic); }

  FATHOM_LANE_FUNCTION static Real sum_of(Vec3 v) { return v.x + (v.y + v.z); }

  /// Impulse of the link's joint on its body in this substep.
  FATHOM_LANE_FUNCTION Vec3 force_of(std::uint32_t i) const {
    return has_generic(i) ? generic(i).force() : state(i).row.impulse;
  }
  /// The last impulse, also where a projection has dropped it.
  FATHOM_LANE_FUNCTION Vec3 last_pull(std::uint32_t i) const { return force_of(i) + state(i).dropped; }
  FATHOM_LANE_FUNCTION Vec3 torque_of(std::uint32_t i) const { return has_generic(i) ? generic(i).torque() : Vec3{}; }
  /// Whether its joint's pull may swing the link's body.
  FATHOM_LANE_FUNCTION Mask may_swing(std::uint32_t i) const {
    if (links[i].joint == none) return is_set(Flag{});
    return has_generic(i) ? inverted(generic(i).is_stiff()) : is_set(all_set);
  }
  /// Motion of a link's parent, or of its obstacle.
  FATHOM_LANE_FUNCTION const LinkMotion& parent_of(std::uint32_t i) const {
    return links[i].parent != none ? state(links[i].parent).motion : state(i).obstacle;
  }
  FATHOM_LANE_FUNCTION LinkPair pair_of(std::uint32_t i) const { return {state(i).motion, parent_of(i)}; }

  // --- the start of a step ---------------------------------------------------------------------------------------

  /// `mass` (kg) of the link, with what loads add; `inertia` (kg·m²) of that mass, in the body's axes.
  FATHOM_LANE_FUNCTION void begin_body(std::uint32_t i, Real mass, const SymMat3& inertia, const LinkStart& body,
                                       Flag is_isotropic) const {
    LinkState& s = state(i);
    s = LinkState{};
    s.mass = mass, s.inertia = inertia;
    s.start = body.rotation;
    s.is_isotropic = is_isotropic;
  }
  /// Anchors are in the bodies' axes; `pull` (m/s²) as in BallJointRow; `impulse` as `last` of what was stored.
  FATHOM_LANE_FUNCTION void begin_ball(std::uint32_t i, const LinkStart& body, const LinkStart& parent, Vec3 anchor,
                                       Vec3 parent_anchor, Vec3 pull, Vec3 impulse) const {
    LinkState& s = state(i);
    prepare_ball_joint<Real>(parent.rotation, body.rotation, body.position - parent.position, parent_anchor, anchor,
                             on_body(i, impulse), s.row);
    s.row.pull = pull;
    s.arm = s.row.arm_b, s.parent_arm = s.row.arm_a;
    begin_joint(i, parent);
  }
  FATHOM_LANE_FUNCTION void begin_generic(std::uint32_t i, const GenericJointDefinition<Real>& joint,
                                          const LinkStart& body, const LinkStart& parent, Vec3 anchor,
                                          Vec3 parent_anchor, Vec3 pull, const GenericImpulseOf<Real>& impulse,
                                          Mask contacts) const {
    LinkState& s = state(i);
    JointLink& of_link = generic(i);
    of_link.begin(joint, links[i].is_b != 0, body, parent, anchor, parent_anchor, pull, impulse, contacts);
    s.arm = of_link.arm(), s.parent_arm = of_link.parent_arm();
    begin_joint(i, parent);
  }
  FATHOM_LANE_FUNCTION void begin_joint(std::uint32_t i, const LinkStart& parent) const {
    LinkState& s = state(i);
    if (links[i].parent == none) s.obstacle = LinkMotion::at_start(parent.linear, parent.angular);
    s.moment = cross(s.arm, force_of(i)) + torque_of(i);
    s.parent_moment = cross(s.parent_arm, force_of(i)) + torque_of(i);
  }
  /// What is stored for a link's joint is on B.
  FATHOM_LANE_FUNCTION Vec3 on_body(std::uint32_t i, Vec3 of_b) const { return links[i].is_b ? of_b : -of_b; }

  // --- what bodies carry into a substep --------------------------------------------------------------------------

  /// `velocity` of the link's body plus `sign` times the effect of the joints' impulses.
  FATHOM_LANE_FUNCTION TreeChange with_carried(std::uint32_t i, float sign, TreeChange velocity) const {
    const MechanismLink& link = links[i];
    const Real inverse_mass = access.body(i, link).inverse_mass;
    const SymMat3 response = access.response(i, link);
    const auto push = [&](float by, Vec3 impulse, Vec3 moment) {
      velocity.linear = mul_add(velocity.linear, by * inverse_mass, impulse);
      velocity.angular += by * (response * moment);
    };
    if (link.joint != none) push(sign, force_of(i), state(i).moment);
    for (std::uint32_t c = link.first_child; c < link.end_of_children(); ++c)
      push(-sign, force_of(c), state(c).parent_moment);
    for (std::uint32_t c = link.next_copy; c != none; c = links[c].next_copy) push(sign, force_of(c), state(c).moment);
    return velocity;
  }
  FATHOM_LANE_FUNCTION void give_carried(std::uint32_t i, float sign) const {
    if (links[i].is_copy()) return;
    const auto body = access.body(i, links[i]);
    const TreeChange with = with_carried(i, sign, {body.linear, body.angular});
    access.set_velocity(i, links[i], with.linear, with.angular);
  }
  FATHOM_LANE_FUNCTION Mask is_carried_slowly(std::uint32_t i, Real h) const {
    if (links[i].is_copy()) return is_set(all_set);
    return h * length(with_carried(i, 1, {}).angular) <= max_drift;
  }
  FATHOM_LANE_FUNCTION void let_go(std::uint32_t i) const {
    state(i).dropped += force_of(i);
    state(i).row.impulse = state(i).moment = state(i).parent_moment = {};
    if (has_generic(i)) generic(i).let_go();
  }
  FATHOM_LANE_FUNCTION bool hangs_on_obstacle(std::uint32_t i) const {
    return links[i].joint != none && links[i].parent == none;
  }
  /// Moves what the link hangs on by a substep of length h (s), like the bodies.
  FATHOM_LANE_FUNCTION void move_obstacle(std::uint32_t i, Real h) const {
    if (!hangs_on_obstacle(i)) return;
    LinkMotion& obstacle = state(i).obstacle;
    obstacle.moved = mul_add(obstacle.moved, h, obstacle.linear);
    obstacle.turned = mul_add(obstacle.turned, h, obstacle.angular);
    obstacle.rotation = rotation_by<Real>(obstacle.turned);
  }

  // --- where links are -------------------------------------------------------------------------------------------

  /// Updates the position, motion and inertia of a link's body.
  FATHOM_FLATTEN FATHOM_LANE_FUNCTION void turn(std::uint32_t i) const {
    LinkState& s = state(i);
    const auto body = access.body(i, links[i]);
    const bool is_isotropic = everywhere(is_set(s.is_isotropic));
    const UnitQuat<Real> unturned{splat<Real>(1), {}}, turned = rotation_by<Real>(body.turned);
    s.spin = is_isotropic ? unturned : turned;
    s.motion = {body.moved,     body.turned, body.linear, turned_by(s.spin, body.angular),
                s.is_isotropic, turned,      unturned};
    s.change = {}, s.impulse = {}, s.load = {};
    s.of_body =
        tree_inertia(s.mass, is_isotropic ? diagonal(s.inertia.xx)
                                          : to_matrix(rotated(rotation_matrix(product(turned, s.start)), s.inertia)));
  }
  /// Gives back what a solution has changed, if it has not stiffened the body.
  FATHOM_LANE_FUNCTION void turn_back(std::uint32_t i) const {
    LinkState& s = state(i);
    const auto body = access.body(i, links[i]);
    s.motion.linear = body.linear, s.motion.angular = turned_by(s.spin, body.angular);
    s.change = {}, s.impulse = {}, s.load = {};
  }
  FATHOM_FLATTEN FATHOM_LANE_FUNCTION void turn_joint(std::uint32_t i, bool relaxes) const {
    LinkState& s = state(i);
    if (relaxes) s.is_eliminated = Flag{};
    if (links[i].joint == none) return;
    if (has_generic(i)) {
      JointLink& joint = generic(i);
      // Before positions move, the joint is still where the last substep left it.
      if (relaxes) joint.look(pair_of(i));
      joint.begin_solution(relaxes);
      choose_coordinates(i);
      s.arm = joint.arm(), s.parent_arm = joint.parent_arm();
      return;
    }
    s.arm = turned_by(s.motion.rotation, s.row.arm_b);
    s.parent_arm = turned_by(parent_of(i).rotation, s.row.arm_a);
  }
  FATHOM_LANE_FUNCTION void choose_coordinates(std::uint32_t i) const {
    if (!has_generic(i)) return;
    const Mask changes = generic(i).choose_coordinates(pair_of(i));
    state(i).is_eliminated = select(changes, Flag{}, state(i).is_eliminated);
  }
  /// Rotations of the bodies at the end of the substep.
  FATHOM_LANE_FUNCTION void look_ahead(std::uint32_t i, Real h) const {
    LinkState& s = state(i);
    s.motion.ahead = rotation_by<Real>(s.motion.turned_ahead(h));
    if (hangs_on_obstacle(i)) s.obstacle.ahead = rotation_by<Real>(s.obstacle.turned_ahead(h));
  }
  /// Whether its locked rotations and the arms of the link's body turn in a substep by no more than rows can represent.
  /// With arms that turn further the stiffness of swings, which is proportional to the last substep's impulses, would
  /// make ever larger ones.
  FATHOM_LANE_FUNCTION Mask turns_slowly(std::uint32_t i, Real h) const {
    const Vec3 turn = h * state(i).motion.angular;
    const auto is_slow = [&](Vec3 arm) { return length(cross(turn, arm)) <= max_drift * length(arm); };
    Mask all_are = is_slow(state(i).arm);
    for (std::uint32_t c = links[i].first_child; c < links[i].end_of_children(); ++c)
      all_are = both(all_are, is_slow(state(c).parent_arm));
    return has_generic(i) ? both(all_are, generic(i).turns_slowly(pair_of(i), h)) : all_are;
  }

  /// Velocity at which the anchors separate.
  FATHOM_LANE_FUNCTION static Vec3 speed_apart(const LinkState& s, const LinkMotion& parent) {
    return (s.motion.linear + cross(s.motion.angular, s.arm)) - (parent.linear + cross(parent.angular, s.parent_arm));
  }
  /// The gap between them.
  FATHOM_LANE_FUNCTION static Vec3 gap(const LinkState& s, const LinkMotion& parent) {
    return s.row.gap + ((s.motion.moved + (s.arm - s.row.arm_b)) - (parent.moved + (s.parent_arm - s.row.arm_a)));
  }
  /// Sets how fast a gap closes. Where the mechanism solves contacts, which may keep it open, a wide gap's pull would
  /// grow without end: it closes the more slowly the harder it pulls, and not at all where the last pull would have
  /// given the whole mechanism, of this `mass` (kg), the speed with which gaps close.
  FATHOM_LANE_FUNCTION void set_closing(std::uint32_t i, Real mass, Mask solves_contacts) const {
    LinkState& s = state(i);
    const Real most = access.push_out_velocity();
    s.closing = most;
    if (links[i].joint == none || !anywhere(solves_contacts)) return;
    const Mask is_wide =
        has_generic(i) ? generic(i).has_wide_gap() : length(gap(s, parent_of(i))) > torn_share * reach(s);
    const Real slowed = max(most - length(last_pull(i)) / mass, Real{});
    s.closing = select(both(solves_contacts, is_wide), slowed, most);
  }
  /// Their gap after the bodies have moved for h (s), divided by h, less what a wide gap may keep: no gap closes faster
  /// than overlaps do, because closing a wide gap at once would throw the body.
  FATHOM_FLATTEN FATHOM_LANE_FUNCTION Vec3 gap_ahead(const LinkState& s, const LinkMotion& parent, Real h) const {
    const auto anchor_ahead = [h](const LinkMotion& m, Vec3 arm) {
      return mul_add(m.moved, h, m.linear) + (turned_by(m.ahead, arm) - arm);
    };
    const Vec3 ahead = s.row.gap + (anchor_ahead(s.motion, s.row.arm_b) - anchor_ahead(parent, s.row.arm_a));
    const Vec3 at_once = (1.0f / h) * gap(s, parent), kept = at_once - limited(at_once, s.closing);
    return mul_add((1.0f / h) * ahead - kept, -0.5f * h, s.row.pull);
  }
  /// The length by which its gaps are judged.
  FATHOM_LANE_FUNCTION static Real reach(const LinkState& s) { return length(s.arm) + length(s.parent_arm); }

  // --- loads -----------------------------------------------------------------------------------------------------

  /// Moments of the impulses that a body has carried over, about arms that have turned since.
  FATHOM_FLATTEN FATHOM_LANE_FUNCTION void load_carried(std::uint32_t i) const {
    LinkState& s = state(i);
    if (links[i].joint != none) s.load.moment += cross(s.arm, force_of(i)) + torque_of(i) - turned_by(s.spin, s.moment);
    for (std::uint32_t c = links[i].first_child; c < links[i].end_of_children(); ++c) {
      const LinkState& child = state(c);
      s.load.moment -= cross(child.parent_arm, force_of(c)) + torque_of(c) - turned_by(s.spin, child.parent_moment);
    }
  }
  /// Stiffness of an impulse's pull on a body that turns about the anchor it acts on: the angular momentum that it
  /// takes per angular velocity within a substep of length h (kg·m²), and the velocity that it acts on.
  FATHOM_LANE_FUNCTION static Real stiffness(Vec3 impulse, Vec3 arm, Real h) {
    return h * max(dot(impulse, arm), Real{});
  }
  FATHOM_LANE_FUNCTION static Vec3 across(Vec3 angular, Vec3 arm) {
    const Vec3 axis = normalize(arm);
    return angular - dot(axis, angular) * axis;
  }
  /// Calls `act(arm, stiffness)` for the body's pull and its children's pulls on it.
  template <class Act>
  FATHOM_LANE_FUNCTION void each_pull(std::uint32_t i, Real h, const Act& act) const {
    const auto pull = [&](std::uint32_t of, Vec3 arm, Vec3 force) {
      const Mask swings = may_swing(of);
      if (anywhere(swings)) act(arm, select(swings, stiffness(force, arm, h), Real{}));
    };
    pull(i, state(i).arm, last_pull(i));
    for (std::uint32_t c = links[i].first_child; c < links[i].end_of_children(); ++c)
      pull(c, state(c).parent_arm, -last_pull(c));
  }
  /// Whether joints turn the body slowly enough under their load for a substep to follow: it swings about its anchor
  /// under a pull F at r with ω² = F r / I, where I is the inertia of it and all that hangs on it. An explicit step
  /// follows up to h ω = 2. A rope under the tension F, L long, swings its ends across it with ω² = F / (L m), too.
  FATHOM_LANE_FUNCTION Mask can_follow(std::uint32_t i, Real h) const {
    Real sum{};  // of (h ω)²
    each_pull(i, h, [&](Vec3 arm, Real k) { sum += k * response_across(i, normalize(arm)); });
    if (has_generic(i)) {
      Real response = generic(i).response_across_rope();
      if (links[i].parent != none) response += access.body(links[i].parent, links[links[i].parent]).inverse_mass;
      sum = fma(generic(i).tension_stiffness(last_pull(i), h), response, sum);
    }
    return sum <= stiffest_swing;
  }
  /// Response of the link's body, with all that hangs on it, to turning across `axis` about its anchor (1/(kg·m²)).
  FATHOM_LANE_FUNCTION Real response_across(std::uint32_t i, Vec3 axis) const {
    if (has_generic(i)) return generic(i).response_across(axis);
    const SymFactor& m = state(i).link.angular;
    return (m.response(unit_vector(1, 0, 0)) + (m.response(unit_vector(0, 1, 0)) + m.response(unit_vector(0, 0, 1)))) -
           m.response(axis);
  }

  // --- elimination -----------------------------------------------------------------------------------------------

  /// Eliminates the link if it or one of its children has changed.
  FATHOM_LANE_FUNCTION void eliminate(std::uint32_t i) const {
    LinkState& s = state(i);
    Mask is_changed = inverted(is_set(s.is_eliminated));
    for (std::uint32_t c = links[i].first_child; c < links[i].end_of_children(); ++c)
      is_changed = either(is_changed, is_set(state(c).is_changed));
    s.is_changed = flag(is_changed);
    if (anywhere(is_changed)) eliminate_link(i);
    s.is_eliminated = all_set;
  }
  FATHOM_FLATTEN FATHOM_LANE_FUNCTION void eliminate_link(std::uint32_t i) const {
    LinkState& s = state(i);
    TreeInertia sum = s.of_body;
    for (std::uint32_t c = links[i].end_of_children(); c-- > links[i].first_child;) {
      if (has_generic(c))
        generic(c).add_to(sum);
      else
        add_child(sum, state(c).link, state(c).parent_arm);
    }
    if (has_generic(i))
      generic(i).eliminate(sum);
    else
      s.link = tree_link(sum, s.arm);
  }
  template <LinkPass pass>
  FATHOM_FLATTEN FATHOM_LANE_FUNCTION void hand_on(std::uint32_t i) const {
    LinkState& s = state(i);
    for (std::uint32_t c = links[i].end_of_children(); c-- > links[i].first_child;) {
      const LinkState& child = state(c);
      s.load.impulse += child.handed.impulse;
      s.load.moment += child.handed.moment + cross(child.parent_arm, child.handed.impulse);
    }
    if (has_generic(i)) {
      s.load.moment -= cross(s.arm, s.load.impulse);
      s.handed = generic(i).hand_on(s.load, pass == LinkPass::aimed);
    } else {
      s.load = at_anchor(s.link, s.load);
      if (links[i].parent != none) s.handed = {handed_on(s.link, s.load, error<pass>(s)), {}};
    }
  }
  template <LinkPass pass>
  FATHOM_LANE_FUNCTION static Vec3 error(const LinkState& s) {
    return pass == LinkPass::aimed ? s.error : Vec3{};
  }
  /// Accumulates the change where it `counts`.
  template <LinkPass pass>
  FATHOM_FLATTEN FATHOM_LANE_FUNCTION void follow_parent(std::uint32_t i, Mask counts) const {
    LinkState& s = state(i);
    if (pass == LinkPass::probing) counts = is_set(Flag{});
    const TreeChange parent = links[i].parent != none ? state(links[i].parent).step : TreeChange{};
    if (links[i].joint == none) {
      s.step = root_change(s.link, s.load);
    } else if (has_generic(i)) {
      s.step = generic(i).follow(parent, pass == LinkPass::aimed, counts);
    } else {
      const Vec3 change = parent.linear + cross(parent.angular, s.parent_arm) - error<pass>(s);
      if (anywhere(counts)) s.impulse = select(counts, s.impulse + impulse_on(s.link, s.load, change), s.impulse);
      s.step = follow(s.link, s.load, change);
    }
    s.load = {};
    if (!anywhere(counts)) return;
    s.change.linear = select(counts, s.change.linear + s.step.linear, s.change.linear);
    s.change.angular = select(counts, s.change.angular + s.step.angular, s.change.angular);
    s.motion.linear = select(counts, s.motion.linear + s.step.linear, s.motion.linear);
    s.motion.angular = select(counts, s.motion.angular + s.step.angular, s.motion.angular);
  }

  // --- contacts ----------------------------------------------------------------------------------------------------

  /// Sweeps over the contacts of one link after the other, children after their parents; `sweep_link(i)` sweeps over
  /// those of link i, at its velocity after all impulses so far, which is `motion` plus `step`. A child follows its
  /// parent's change as the sweep goes down, and a parent responds to what its child hands on as it comes up. Leaves
  /// the sums of the impulses as loads. `leads(i)`: the link, or one below it, has contacts; `root` does.
  template <class Leads, class SweepLink>
  FATHOM_LANE_FUNCTION void sweep_along_tree(std::uint32_t root, std::uint32_t end, const Leads& leads,
                                             const SweepLink& sweep_link) const {
    std::uint32_t i = root;
    begin_branch(i);
    sweep_link(i);
    for (std::uint32_t next = links[i].first_child;;) {
      while (next < links[i].end_of_children() && !leads(next)) ++next;
      if (next < links[i].end_of_children()) {
        i = next;
        begin_branch(i);
        sweep_link(i);
        next = links[i].first_child;
      } else if (i != root) {
        end_branch(i);
        next = i + 1;
        i = links[i].parent;
      } else {
        break;
      }
    }
    for (i = root; i < end; ++i)
      if (leads(i)) state(i).load = access.pushes(i).load;
  }
  /// The link follows its parent's change.
  FATHOM_FLATTEN FATHOM_LANE_FUNCTION void begin_branch(std::uint32_t i) const {
    LinkState& s = state(i);
    access.pushes(i).load = s.load = {};
    s.step = {};
    if (links[i].parent == none) return;
    TreeLoad nothing;
    hand_on_load(i, {}, nothing);
    s.step = follow_load(i, nothing, state(links[i].parent).step);
  }
  /// Its parent responds to what the contacts of the link, and of all that hangs on it, hand on.
  FATHOM_FLATTEN FATHOM_LANE_FUNCTION void end_branch(std::uint32_t i) const {
    TreeLoad at_joint;
    push(links[i].parent, hand_on_load(i, state(i).load, at_joint));
  }
  /// Contacts of the link give it an impulse and a moment in the axes of its spin.
  FATHOM_FLATTEN FATHOM_LANE_FUNCTION void push_by_contacts(std::uint32_t i, Vec3 impulse, Vec3 moment) const {
    TreeLoad& own = access.pushes(i).load;
    own = {impulse, turned_by(state(i).spin, moment)};
    push(i, own);
  }
  /// Adds a load about the link's centre, and the link's response.
  FATHOM_LANE_FUNCTION void push(std::uint32_t i, const TreeLoad& load) const {
    LinkState& s = state(i);
    s.load.impulse += load.impulse, s.load.moment += load.moment;
    const TreeChange change = response_to(i, load);
    s.step.linear += change.linear, s.step.angular += change.angular;
  }
  FATHOM_LANE_FUNCTION TreeChange response_to(std::uint32_t i, const TreeLoad& load) const {
    const LinkPushes& p = access.pushes(i);
    const UnitQuat<Real>& spin = state(i).spin;
    const Vec3 f = load.impulse, m = turned_back_by(spin, load.moment);
    const auto sum = [&](auto part) FATHOM_LANE_LAMBDA {
      Vec3 v = f.x * part(p.by_impulse[0]);
      v = mul_add(mul_add(v, f.y, part(p.by_impulse[1])), f.z, part(p.by_impulse[2]));
      v = mul_add(mul_add(v, m.x, part(p.by_moment[0])), m.y, part(p.by_moment[1]));
      return mul_add(v, m.z, part(p.by_moment[2]));
    };
    return {sum([](const TreeChange& c) FATHOM_LANE_LAMBDA { return c.linear; }),
            turned_by(spin, sum([](const TreeChange& c) FATHOM_LANE_LAMBDA { return c.angular; }))};
  }
  /// The response of the link's body to each unit impulse and moment, from that of its parent.
  FATHOM_FLATTEN FATHOM_LANE_FUNCTION void find_response(std::uint32_t i) const {
    const UnitQuat<Real>& spin = state(i).spin;
    const auto respond = [&](const TreeLoad& load) FATHOM_LANE_LAMBDA {
      TreeChange change = links[i].joint == none ? root_change(state(i).link, at_anchor(state(i).link, load))
                                                 : respond_at_joint(i, load);
      change.angular = turned_back_by(spin, change.angular);
      return change;
    };
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 unit = unit_vector(axis == 0 ? 1.0f : 0.0f, axis == 1 ? 1.0f : 0.0f, axis == 2 ? 1.0f : 0.0f);
      access.pushes(i).by_impulse[axis] = respond({unit, {}});
      access.pushes(i).by_moment[axis] = respond({{}, turned_by(spin, unit)});
    }
  }
  FATHOM_LANE_FUNCTION TreeChange respond_at_joint(std::uint32_t i, const TreeLoad& load) const {
    TreeLoad at_joint;
    const TreeLoad handed = hand_on_load(i, load, at_joint);
    return follow_load(i, at_joint, links[i].parent != none ? response_to(links[i].parent, handed) : TreeChange{});
  }
  /// What the parent gets, about its centre, of a load about the link's centre; `at_joint`: that load at the joint.
  FATHOM_LANE_FUNCTION TreeLoad hand_on_load(std::uint32_t i, const TreeLoad& load, TreeLoad& at_joint) const {
    const LinkState& s = state(i);
    TreeLoad handed;
    if (has_generic(i)) {
      at_joint = {load.impulse, load.moment - cross(s.arm, load.impulse)};
      handed = generic(i).hand_on(at_joint, false);
    } else {
      at_joint = at_anchor(s.link, load);
      handed = {handed_on(s.link, at_joint, {}), {}};
    }
    return {handed.impulse, handed.moment + cross(s.parent_arm, handed.impulse)};
  }
  /// The link's change under a load at its joint, which for a generic joint is the last one handed on.
  FATHOM_LANE_FUNCTION TreeChange follow_load(std::uint32_t i, const TreeLoad& at_joint,
                                              const TreeChange& parent) const {
    if (has_generic(i)) return generic(i).follow(parent, false, is_set(Flag{}));
    return follow(state(i).link, at_joint, parent.linear + cross(parent.angular, state(i).parent_arm));
  }

  // --- what rounds aim at, and have found ------------------------------------------------------------------------

  FATHOM_FLATTEN FATHOM_LANE_FUNCTION void aim_ahead(std::uint32_t i, Real h) const {
    if (links[i].joint == none) return;
    if (has_generic(i))
      generic(i).aim_ahead(pair_of(i), state(i).closing, h);
    else
      state(i).error = gap_ahead(state(i), parent_of(i), h);
  }
  /// Whether a round would remove no more than this share of the arms.
  FATHOM_LANE_FUNCTION Mask is_aimed_within(std::uint32_t i, Real share, Real h) const {
    if (links[i].joint == none) return is_set(all_set);
    if (has_generic(i)) return generic(i).is_aimed_within(share, h);
    return h * length(state(i).error) <= share * reach(state(i));
  }
  FATHOM_FLATTEN FATHOM_LANE_FUNCTION void aim_at_rest(std::uint32_t i, float gap_share, Real h) const {
    if (links[i].joint == none) return;
    LinkState& s = state(i);
    const Real most = s.closing;
    const LinkMotion& parent = parent_of(i);
    if (has_generic(i))
      return generic(i).aim_at_rest({s.motion, parent}, splat<Real>(gap_share), splat<Real>(closing_share), most, h);
    s.error = speed_apart(s, parent);
    if (gap_share > 0) {
      const Real least = (closing_share / h) * reach(s);
      const Vec3 pull = limited((gap_share / h) * gap(s, parent), min(most, length(s.error) + least));
      s.error = mul_add(s.error + pull, -0.5f * h, s.row.pull);
    }
  }
  /// Whether the anchors will meet, along a path that rows can represent: otherwise a body that its joints spin around
  /// within a substep would count as meeting too.
  FATHOM_LANE_FUNCTION Mask does_meet(std::uint32_t i, Real h) const {
    const LinkState& s = state(i);
    const Mask is_slow = h * length(s.change.angular) <= max_drift;
    if (links[i].joint == none || !anywhere(is_slow)) return is_slow;
    if (has_generic(i)) return both(is_slow, generic(i).meets(pair_of(i), splat<Real>(meeting_share), h));
    return both(is_slow, h * length(gap_ahead(s, parent_of(i), h)) <= meeting_share * reach(s));
  }
  /// Whether some limit or largest force differs from what the solution assumed, among those in `asks`.
  FATHOM_LANE_FUNCTION Mask revise(std::uint32_t i, Real h, Mask asks) const {
    return has_generic(i) ? generic(i).revise(pair_of(i), h, asks) : is_set(Flag{});
  }
  /// See `JointLink::note_pressed`.
  FATHOM_LANE_FUNCTION void note_pressed(std::uint32_t i, Real h, Mask contacts) const {
    if (has_generic(i)) generic(i).note_pressed(pair_of(i), h, contacts);
  }
  /// Whether some drive exceeds its largest force …
  FATHOM_LANE_FUNCTION Mask overdrives(std::uint32_t i, bool motors_only) const {
    return has_generic(i) ? generic(i).overdrives(pair_of(i), motors_only) : is_set(Flag{});
  }
  /// … and is put at it.
  FATHOM_LANE_FUNCTION Mask restrain(std::uint32_t i, bool motors_only) const {
    return has_generic(i) ? generic(i).restrain(pair_of(i), motors_only) : is_set(Flag{});
  }
  /// Whether a solution leaves the body with an allowed velocity.
  FATHOM_LANE_FUNCTION Mask is_sound(std::uint32_t i, Real h) const {
    const LinkState& s = state(i);
    const auto limits = access.limits(h);
    Real sum = sum_of(s.impulse);
    if (has_generic(i)) sum += sum_of(generic(i).force_more() + generic(i).torque_more());
    return both(is_finite(sum),
                both(length(s.motion.linear) <= limits.linear, length(s.motion.angular) <= limits.angular));
  }

  template <bool soft>
  FATHOM_FLATTEN FATHOM_LANE_FUNCTION void apply(std::uint32_t i, Real h, bool follows) const {
    const MechanismLink& link = links[i];
    LinkState& s = state(i);
    if (!link.is_copy()) access.add_velocity(i, link, s.change.linear, turned_back_by(s.spin, s.change.angular));
    if (link.joint == none) return;
    const Vec3 before = last_pull(i);
    s.dropped = {};
    Vec3 force = s.impulse, torque;
    if (has_generic(i)) {
      JointLink& joint = generic(i);
      force = joint.force_more(), torque = joint.torque_more();
      joint.apply(pair_of(i), !soft);
    } else {
      s.row.impulse += s.impulse;
      if (!soft) s.row.total += s.row.impulse;
    }
    const Mask swings = soft && !follows ? may_swing(i) : is_set(Flag{});
    const auto moment_at = [&](Vec3 arm, Vec3 pull, const LinkMotion& motion, float sign) {
      Vec3 moment = cross(arm, soft ? force_of(i) : force) + (soft ? torque_of(i) : torque);
      if (anywhere(swings))
        moment = select(swings, moment - sign * (stiffness(pull, arm, h) * across(motion.angular, arm)), moment);
      return moment;
    };
    s.moment = turned_back_by(s.spin, moment_at(s.arm, before, s.motion, 1)) + (soft ? Vec3{} : s.moment);
    if (link.parent == none) return;
    const LinkState& parent = state(link.parent);
    s.parent_moment = turned_back_by(parent.spin, moment_at(s.parent_arm, -before, parent.motion, -1)) +
                      (soft ? Vec3{} : s.parent_moment);
  }
};
