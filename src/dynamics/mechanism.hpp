// Mechanisms: bodies that rigid joints connect to a tree, solved directly (dynamics/joint_tree.hpp) where sweeps would
// give way. Pure, for host and device.
//
// A direct solution takes the place of the joints' rows in a sweep, after the contacts': bodies leave it with
// velocities that all joints agree with. Its substep is that of the rows (dynamics/ball_joint-inl.hpp).
//
// A loop is cut at one of its bodies, of which the tree gets a copy (dynamics/loop_closure.hpp).
//
// A mechanism is one team's (math/team.hpp), whose work-items share its links. Each link adds up what its children hand
// it, in their order, so that no result depends on the team.
#pragma once

#include <cstdint>

#include "dynamics/joint_link.hpp"
#include "dynamics/joint_tree.hpp"
#include "dynamics/loop_closure.hpp"
#include "dynamics/mechanism_link.hpp"
#include "dynamics/solver_body.hpp"
#include "dynamics/speed_limits.hpp"
#include "dynamics/tuning.hpp"
#include "math/team.hpp"

namespace fathom {

#if defined(__CUDACC__)
#define FATHOM_FLATTEN
#else
/// Called, their arguments would pass through memory, which costs more than what they do.
#define FATHOM_FLATTEN [[gnu::flatten]]
#endif

/// Solves mechanisms of the bodies and joints that `Access` knows, by the numbers that links have for them:
///
///     body(i): SolverBody;  set_velocity(i, linear, angular);  add_velocity likewise
///     is_isotropic(i), inverse_mass(i), inertia(i): its own, whatever loads have added;  pose(i)
///     response(i, body): inverse inertia as the spin is written;  swing(link): m/s² of a body that swings, or 0
///     joint(j): {a, b, anchor_a, anchor_b};  last_impulse(j), generic(j), generic_impulse(j)
///     store(j, last, total);  store(j, GenericImpulse);  push_out_velocity();  limits(h): SpeedLimits
template <class Access>
class MechanismSolver {
 public:
  static constexpr std::uint32_t none = MechanismLink::none;

  Access access;
  const MechanismLink* links;
  const std::uint32_t* levels;
  LinkState* states;
  JointLink* generic;
  float* closures;

  /// Reads joints and bodies as the step begins.
  FATHOM_HD void prepare(const Mechanism& m) const {
    each(m, [&](std::uint32_t i) { prepare_link(i); });
  }
  /// The last step's impulses act again, or are forgotten. Along arms that have turned since they may spin a thin rod
  /// several times per substep round its axis, which contacts would take for the speed of its surface: then all of
  /// them are let go.
  FATHOM_HD void warm_start(const Mechanism& m, float h, bool forgets) const {
    let_closures_go(m);
    if (forgets)
      each(m, [&](std::uint32_t i) { forget_link(i); });
    else if (all(m, [&](std::uint32_t i) { return is_carried_slowly(i, h); }))
      each(m, [&](std::uint32_t i) { give_carried(i, 1); });
    else
      each(m, [&](std::uint32_t i) { let_go(i); });
  }
  /// Before positions move.
  FATHOM_HD void pull_together(const Mechanism& m, float h) const { solve<true>(m, h); }
  /// And after.
  FATHOM_HD void relax(const Mechanism& m, float h) const {
    each(m, [&](std::uint32_t i) { move_obstacle(states[i].obstacle, h); });
    solve<false>(m, h);
  }
  FATHOM_HD void store(const Mechanism& m) const {
    each(m, [&](std::uint32_t i) { store_link(i); });
  }

  FATHOM_HD void prepare_link(std::uint32_t i) const {
    const MechanismLink& link = links[i];
    LinkState& s = states[i];
    s = {};
    const std::uint32_t copies = link.is_copy() ? links[link.original].copies : link.copies;
    s.mass = 1 / (static_cast<float>(copies + 1) * access.body(link.body).inverse_mass);
    if (link.joint == none) return;
    if (link.parent == none) {
      const auto& obstacle = access.body(link.obstacle);
      s.obstacle = {{}, {}, obstacle.linear, obstacle.angular};
    }
    if (link.generic == none)
      prepare_ball(link, s);
    else
      prepare_generic(i);
    s.moment = cross(s.arm, force_of(i)) + torque_of(i);
    s.parent_moment = cross(s.parent_arm, force_of(i)) + torque_of(i);
  }
  FATHOM_HD void store_link(std::uint32_t i) const {
    const MechanismLink& link = links[i];
    if (link.joint == none) return;
    const BallJointRow<float>& row = states[i].row;
    if (link.generic == none)
      access.store(link.joint, on_body(link, row.impulse), on_body(link, row.total));
    else
      access.store(link.joint, generic[link.generic].impulse());
  }

 private:
  // --- who does what ---------------------------------------------------------------------------------------------

  template <class Act>
  FATHOM_HD static void each(const Mechanism& m, const Act& act) {
    for (std::uint32_t i = m.first + team::item(); i < m.end; i += team::items) act(i);
    team::sync();
  }
  template <class Test>
  FATHOM_HD static bool all(const Mechanism& m, const Test& test) {
    bool holds = true;
    for (std::uint32_t i = m.first + team::item(); i < m.end; i += team::items) holds = test(i) && holds;
    return team::all(holds);
  }
  template <class Act>
  FATHOM_HD void each_of_level(const Mechanism& m, std::uint32_t level, const Act& act) const {
    const std::uint32_t first = levels[m.level + level], end = levels[m.level + level + 1];
    for (std::uint32_t i = first + team::item(); i < end; i += team::items) act(i);
    team::sync();
  }
  template <class Act>
  FATHOM_HD void from_leaves(const Mechanism& m, const Act& act) const {
    for (std::uint32_t level = m.levels; level-- > 0;) each_of_level(m, level, act);
  }
  template <class Act>
  FATHOM_HD void from_root(const Mechanism& m, const Act& act) const {
    for (std::uint32_t level = 0; level < m.levels; ++level) each_of_level(m, level, act);
  }

  FATHOM_HD static Vec3 on_body(const MechanismLink& link, Vec3 of_b) { return link.is_b ? of_b : -of_b; }
  FATHOM_HD static UnitQuat<float> rotation(const Pose& pose) { return {pose.rotation.w, pose.rotation.vector()}; }
  FATHOM_HD static float sum_of(Vec3 v) { return v.x + (v.y + v.z); }

  /// What the link's joint has given its body in this substep.
  FATHOM_HD Vec3 force_of(std::uint32_t i) const {
    return links[i].generic == none ? states[i].row.impulse : generic[links[i].generic].force();
  }
  FATHOM_HD Vec3 torque_of(std::uint32_t i) const {
    return links[i].generic == none ? Vec3{} : generic[links[i].generic].torque();
  }
  /// Whether the pull of its joint may swing the link's body.
  FATHOM_HD bool may_swing(std::uint32_t i) const {
    return links[i].joint != none && (links[i].generic == none || !generic[links[i].generic].is_stiff());
  }
  /// Of a link's parent or of what it hangs on.
  FATHOM_HD const LinkMotion& parent_of(std::uint32_t i) const {
    return links[i].parent != none ? states[links[i].parent].motion : states[i].obstacle;
  }

  // --- a step ----------------------------------------------------------------------------------------------------

  /// m/s², of bodies that swing how much more the link's body accelerates than its parent
  FATHOM_HD Vec3 pull_of(const MechanismLink& link) const {
    return access.swing(link) - (link.parent != none ? access.swing(links[link.parent]) : Vec3{});
  }
  FATHOM_HD void prepare_ball(const MechanismLink& link, LinkState& s) const {
    const auto j = access.joint(link.joint);
    const std::uint32_t parent = link.is_b ? j.a : j.b;
    const Pose &of_parent = access.pose(parent), &of_body = access.pose(link.body);
    prepare_ball_joint<float>(rotation(of_parent), rotation(of_body), of_body.position - of_parent.position,
                              link.is_b ? j.anchor_a : j.anchor_b, link.is_b ? j.anchor_b : j.anchor_a,
                              on_body(link, access.last_impulse(link.joint)), s.row);
    s.row.pull = pull_of(link);
    s.arm = s.row.arm_b, s.parent_arm = s.row.arm_a;
  }
  FATHOM_HD void prepare_generic(std::uint32_t i) const {
    const MechanismLink& link = links[i];
    const auto j = access.joint(link.joint);
    const GenericJoint& joint = access.generic(link.joint);
    const Pose &a = access.pose(j.a), &b = access.pose(j.b);
    GenericJointRow<float> row{};
    prepare_generic_joint<float>(rotation(a), rotation(b), b.position - a.position, joint.on_a, joint.on_b, j.anchor_a,
                                 j.anchor_b, row);
    row.pull = link.is_b ? pull_of(link) : -pull_of(link);
    if (joint.reacts != 0) {
      const JointBodies<SymMat3> bodies = bodies_of(i);
      begin_rates(row, joint, bodies.a, bodies.b);
    }
    JointLink& of_link = generic[link.generic];
    of_link.begin(joint, link.is_b != 0, row, access.generic_impulse(link.joint));
    states[i].arm = of_link.arm(), states[i].parent_arm = of_link.parent_arm();
  }
  /// What velocities of the link's body become by `sign` times the joints' impulses.
  FATHOM_HD TreeChange with_carried(std::uint32_t i, float sign, TreeChange velocity) const {
    const MechanismLink& link = links[i];
    const SolverBody body = access.body(link.body);
    const SymMat3 response = access.response(link.body, body);
    const auto push = [&](float by, Vec3 impulse, Vec3 moment) {
      velocity.linear = mul_add(velocity.linear, by * body.inverse_mass, impulse);
      velocity.angular += by * (response * moment);
    };
    if (link.joint != none) push(sign, force_of(i), states[i].moment);
    for (std::uint32_t c = link.first_child; c < link.end_of_children(); ++c)
      push(-sign, force_of(c), states[c].parent_moment);
    for (std::uint32_t c = link.next_copy; c != none; c = links[c].next_copy) push(sign, force_of(c), states[c].moment);
    return velocity;
  }
  FATHOM_HD void give_carried(std::uint32_t i, float sign) const {
    if (links[i].is_copy()) return;
    const SolverBody body = access.body(links[i].body);
    const TreeChange with = with_carried(i, sign, {body.linear, body.angular});
    access.set_velocity(links[i].body, with.linear, with.angular);
  }
  /// Whether the link's body would be no faster without what it carries than bodies may be.
  FATHOM_HD bool is_sound_without_carried(std::uint32_t i, float h) const {
    if (links[i].is_copy()) return true;
    const SolverBody body = access.body(links[i].body);
    const TreeChange without = with_carried(i, -1, {body.linear, body.angular});
    const SpeedLimits limits = access.limits(h);
    return length(without.linear) <= limits.linear && length(without.angular) <= limits.angular;
  }
  FATHOM_HD bool is_carried_slowly(std::uint32_t i, float h) const {
    return links[i].is_copy() || h * length(with_carried(i, 1, {}).angular) <= max_drift;
  }
  FATHOM_HD void let_go(std::uint32_t i) const {
    states[i].row.impulse = states[i].moment = states[i].parent_moment = {};
    if (links[i].generic != none) generic[links[i].generic].let_go();
  }
  /// What is not finite of one body reaches no other.
  FATHOM_HD void forget_link(std::uint32_t i) const {
    BallJointRow<float>& row = states[i].row;
    row.impulse = row.total = states[i].moment = states[i].parent_moment = {};
    if (links[i].generic != none) generic[links[i].generic].forget();
  }
  /// On by a substep of length h (s), as bodies are.
  FATHOM_HD static void move_obstacle(LinkMotion& obstacle, float h) {
    obstacle.moved = mul_add(obstacle.moved, h, obstacle.linear);
    obstacle.turned = mul_add(obstacle.turned, h, obstacle.angular);
    obstacle.rotation = rotation_by<float>(obstacle.turned);
  }
  // --- a solution ------------------------------------------------------------------------------------------------

  template <bool soft>
  FATHOM_HD void solve(const Mechanism& m, float h) const {
    turn_all(m, h, !soft);
    const bool looks_ahead = soft && all(m, [&](std::uint32_t i) { return turns_slowly(i, h); });
    if (soft && !looks_ahead) start_anew(m, h);
    bool follows = solve_with_limits<soft>(m, h, looks_ahead);
    if (looks_ahead && !do_meet(m, h)) {
      start_anew(m, h);
      follows = solve_with_limits<soft>(m, h, false);
    }
    if (all(m, [&](std::uint32_t i) { return is_sound(i, h); }))
      apply_all<soft>(m, h, follows);
    else if (!all(m, [&](std::uint32_t i) { return carries_finite(i); }))
      forget(m);
    else if (soft)
      start_anew(m, h);
  }

  /// Takes back what the last substep's impulses have given. Along arms that have turned they would cancel to no more
  /// than their rounding, of which light bodies on long arms make ever larger impulses. Not where a rod has turned so
  /// far that these would spin it about its axis, of which it got nothing: that would throw it the other way.
  FATHOM_HD void start_anew(const Mechanism& m, float h) const {
    if (all(m, [&](std::uint32_t i) { return is_sound_without_carried(i, h); }))
      each(m, [&](std::uint32_t i) { give_carried(i, -1); });
    each(m, [&](std::uint32_t i) { let_go(i); });
    let_closures_go(m);
    turn_all(m, h, false);
  }
  FATHOM_HD void forget(const Mechanism& m) const {
    each(m, [&](std::uint32_t i) { forget_link(i); });
    let_closures_go(m);
  }

  /// So that anchors meet at the substep's end, or that they do not move against each other. The latter never adds
  /// energy but for the share of gaps that it closes, whatever arms do within the substep. Begins anew where the result
  /// says that other limits act, or drives give their most: mostly the first round tells. Returns whether the substep
  /// follows all swings.
  template <bool soft>
  FATHOM_HD bool solve_with_limits(const Mechanism& m, float h, bool looks_ahead) const {
    for (int revision = 0;; ++revision) {
      const auto has_to_revise = [&] { return soft && revision < max_revisions && revise(m, h); };
      const bool follows = eliminate_all<soft>(m, h, looks_ahead);
      if (looks_ahead)
        take_first_round(m, h);
      else
        come_to_rest<soft>(m, h);
      if (!has_to_revise() && !(looks_ahead && take_more_rounds(m, h) && has_to_revise())) return follows;
      take_back(m);
    }
  }
  /// With what bodies carry over for their loads. Returns whether the substep follows all swings.
  template <bool soft>
  FATHOM_HD bool eliminate_all(const Mechanism& m, float h, bool looks_ahead) const {
    from_leaves(m, [&](std::uint32_t i) { eliminate(i); });
    const bool follows = !looks_ahead || can_follow(m, h);
    if (!follows) {
      each(m, [&](std::uint32_t i) { stiffen(i, h); });
      from_leaves(m, [&](std::uint32_t i) { eliminate(i); });
    }
    if (m.closures > 0) find_responses(m);
    if constexpr (soft) each(m, [&](std::uint32_t i) { load_carried(i); });
    if (!follows) each(m, [&](std::uint32_t i) { load_stiffened(i, h); });
    return follows;
  }
  FATHOM_HD void take_first_round(const Mechanism& m, float h) const {
    look_ahead(m, h);
    aim_ahead(m, h);
    substitute(m, 1);
    look_ahead(m, h);
  }
  /// As long as another round helps, up to `newton_rounds` in all. Returns whether there was one.
  FATHOM_HD bool take_more_rounds(const Mechanism& m, float h) const {
    for (int round = 1; round < newton_rounds; ++round) {
      aim_ahead(m, h);
      if (m.closures == 0 && all(m, [&](std::uint32_t i) { return is_aimed_within(i, aimed_share, h); }))
        return round > 1;
      substitute(m, 1);
      look_ahead(m, h);
    }
    return true;
  }
  template <bool soft>
  FATHOM_HD void come_to_rest(const Mechanism& m, float h) const {
    aim_at_rest(m, soft ? projection_share : 0.0f, h);
    substitute(m, closing_rounds);
  }

  /// Whether a solution leaves the body with a velocity that bodies may have.
  FATHOM_HD bool is_sound(std::uint32_t i, float h) const {
    const LinkState& s = states[i];
    const SpeedLimits limits = access.limits(h);
    float sum = sum_of(s.impulse);
    if (links[i].generic != none) {
      const JointLink& joint = generic[links[i].generic];
      sum += sum_of(joint.force_more() + joint.torque_more());
    }
    return is_finite(sum) && length(s.motion.linear) <= limits.linear && length(s.motion.angular) <= limits.angular;
  }
  FATHOM_HD bool carries_finite(std::uint32_t i) const {
    return is_finite(sum_of(force_of(i)) + sum_of(states[i].moment + states[i].parent_moment));
  }

  FATHOM_HD void turn_all(const Mechanism& m, float h, bool relaxes) const {
    each(m, [&](std::uint32_t i) { turn(i); });
    each(m, [&](std::uint32_t i) { turn_joint(i, h, relaxes); });
  }
  /// What a solution has found, so that it begins anew with other limits.
  FATHOM_HD void take_back(const Mechanism& m) const {
    each(m, [&](std::uint32_t i) { turn(i); });
    each(m, [&](std::uint32_t i) {
      if (links[i].generic != none && generic[links[i].generic].choose_coordinates({states[i].motion, parent_of(i)}))
        states[i].is_eliminated = false;
    });
  }
  /// Where a link's body is now, how it moves, and what it resists that with.
  FATHOM_FLATTEN FATHOM_HD void turn(std::uint32_t i) const {
    LinkState& s = states[i];
    const std::uint32_t number = links[i].body;
    const auto& body = access.body(number);
    const bool is_isotropic = access.is_isotropic(number);
    const UnitQuat<float> turned = rotation_by<float>(body.turned);
    s.spin = is_isotropic ? UnitQuat<float>{1, {}} : turned;
    s.motion = {body.moved, body.turned, body.linear, turned_by(s.spin, body.angular), is_isotropic, turned};
    s.change = {}, s.impulse = {}, s.load = {};
    const float scale = s.mass * access.inverse_mass(number);  // of the inertia that loads have added
    Mat3 inertia = diagonal(scale * access.inertia(number).xx);
    if (!is_isotropic) {
      const Quat now = Quat{turned.w, turned.v.x, turned.v.y, turned.v.z} * access.pose(number).rotation;
      inertia = to_matrix(scale * rotated(to_matrix(now), access.inertia(number)));
    }
    s.of_body = tree_inertia(s.mass, inertia);
  }
  FATHOM_FLATTEN FATHOM_HD void turn_joint(std::uint32_t i, float h, bool relaxes) const {
    LinkState& s = states[i];
    const MechanismLink& link = links[i];
    if (relaxes) s.is_eliminated = false;
    if (link.joint == none) return;
    if (link.generic != none) {
      JointLink& joint = generic[link.generic];
      // Before positions move it is where the last substep has left it.
      if (relaxes) joint.look({s.motion, parent_of(i)});
      joint.begin_solution(relaxes);
      if (joint.asks_for_masses()) joint.look_at_masses(bodies_of(i), h);
      if (joint.choose_coordinates({s.motion, parent_of(i)})) s.is_eliminated = false;
      s.arm = joint.arm(), s.parent_arm = joint.parent_arm();
      return;
    }
    s.arm = turned_by(s.motion.rotation, s.row.arm_b);
    s.parent_arm = turned_by(parent_of(i).rotation, s.row.arm_a);
  }
  FATHOM_HD JointBodies<SymMat3> bodies_of(std::uint32_t i) const {
    const MechanismLink& link = links[i];
    const auto j = access.joint(link.joint);
    const auto side = [&](std::uint32_t number) {
      if (number != link.body && link.parent == none) {
        const LinkMotion& m = states[i].obstacle;
        return typename JointBodies<SymMat3>::Side{m.linear, m.angular, m.moved, m.turned, 0, 0, {}};
      }
      const auto& body = access.body(number);
      return typename JointBodies<SymMat3>::Side{body.linear,
                                                 body.angular,
                                                 body.moved,
                                                 body.turned,
                                                 body.inverse_mass,
                                                 body.inverse_inertia,
                                                 access.response(number, body)};
    };
    return {side(j.a), side(j.b)};
  }

  /// How fast the anchors run away from each other.
  FATHOM_HD static Vec3 speed_apart(const LinkState& s, const LinkMotion& parent) {
    return (s.motion.linear + cross(s.motion.angular, s.arm)) - (parent.linear + cross(parent.angular, s.parent_arm));
  }
  /// How far they are apart.
  FATHOM_HD static Vec3 gap(const LinkState& s, const LinkMotion& parent) {
    return s.row.gap + ((s.motion.moved + (s.arm - s.row.arm_b)) - (parent.moved + (s.parent_arm - s.row.arm_a)));
  }
  /// How far they will be apart when the bodies have moved on for h (s), over h, beyond what a wide gap may keep: no
  /// gap closes faster than overlaps do, because to bring what is far apart together at once would throw it.
  FATHOM_FLATTEN FATHOM_HD Vec3 gap_ahead(const LinkState& s, const LinkMotion& parent, float h) const {
    const auto anchor_ahead = [h](const LinkMotion& m, Vec3 arm) {
      return mul_add(m.moved, h, m.linear) + (turned_by(m.ahead, arm) - arm);
    };
    const Vec3 ahead = s.row.gap + (anchor_ahead(s.motion, s.row.arm_b) - anchor_ahead(parent, s.row.arm_a));
    const Vec3 at_once = (1 / h) * gap(s, parent), kept = at_once - limited(at_once, access.push_out_velocity());
    return mul_add((1 / h) * ahead - kept, -0.5f * h, s.row.pull);
  }

  // --- loads -----------------------------------------------------------------------------------------------------

  /// Moments of what a body has carried over, about arms that have turned since.
  FATHOM_FLATTEN FATHOM_HD void load_carried(std::uint32_t i) const {
    LinkState& s = states[i];
    if (links[i].joint != none) s.load.moment += cross(s.arm, force_of(i)) + torque_of(i) - turned_by(s.spin, s.moment);
    for (std::uint32_t c = links[i].first_child; c < links[i].end_of_children(); ++c) {
      const LinkState& child = states[c];
      s.load.moment -= cross(child.parent_arm, force_of(c)) + torque_of(c) - turned_by(s.spin, child.parent_moment);
    }
  }
  /// The pull of an impulse on a body that turns about the anchor it acts on: what it takes of the angular velocity
  /// within a substep of length h (kg·m²), and of which velocity.
  FATHOM_HD static float stiffness(Vec3 impulse, Vec3 arm, float h) { return h * max(dot(impulse, arm), 0.0f); }
  FATHOM_HD static Vec3 across(Vec3 angular, Vec3 arm) {
    const Vec3 axis = normalize(arm);
    return angular - dot(axis, angular) * axis;
  }
  /// Of the body and its children's pulls on it, `act(arm, stiffness)`.
  template <class Act>
  FATHOM_HD void each_pull(std::uint32_t i, float h, const Act& act) const {
    if (may_swing(i)) act(states[i].arm, stiffness(force_of(i), states[i].arm, h));
    for (std::uint32_t c = links[i].first_child; c < links[i].end_of_children(); ++c)
      if (may_swing(c)) act(states[c].parent_arm, stiffness(-force_of(c), states[c].parent_arm, h));
  }
  FATHOM_HD void stiffen(std::uint32_t i, float h) const {
    LinkState& body = states[i];
    body.is_eliminated = false;
    each_pull(i, h, [&](Vec3 arm, float k) {
      const Vec3 axis = normalize(arm);
      const Mat3 outer{axis.x * axis, axis.y * axis, axis.z * axis};
      body.of_body.angular = body.of_body.angular + k * (diagonal(1) - outer);
    });
  }
  /// What that resists of the motion that the body has.
  FATHOM_HD void load_stiffened(std::uint32_t i, float h) const {
    LinkState& body = states[i];
    body.is_eliminated = false;  // but stiffened
    each_pull(i, h, [&](Vec3 arm, float k) { body.load.moment -= k * across(body.motion.angular, arm); });
  }

  // --- elimination -----------------------------------------------------------------------------------------------

  /// If it or one of its children has changed.
  FATHOM_HD void eliminate(std::uint32_t i) const {
    LinkState& s = states[i];
    s.is_changed = !s.is_eliminated;
    for (std::uint32_t c = links[i].first_child; c < links[i].end_of_children(); ++c)
      s.is_changed = s.is_changed || states[c].is_changed;
    if (s.is_changed) eliminate_link(i);
    s.is_eliminated = true;
  }
  FATHOM_FLATTEN FATHOM_HD void eliminate_link(std::uint32_t i) const {
    LinkState& s = states[i];
    TreeInertia sum = s.of_body;
    for (std::uint32_t c = links[i].end_of_children(); c-- > links[i].first_child;) {
      if (links[c].generic != none)
        generic[links[c].generic].add_to(sum);
      else
        add_child(sum, states[c].link, states[c].parent_arm);
    }
    if (links[i].generic != none)
      generic[links[i].generic].eliminate(sum);
    else
      s.link = tree_link(sum, s.arm);
  }
  /// What a substitution does: it takes away all links' errors under their loads, answers closures' loads besides, or
  /// only tells in `LinkState::step` what these would do.
  enum class Pass { aimed, closing, probing };

  FATHOM_HD void substitute(const Mechanism& m, int rounds) const {
    substitute<Pass::aimed>(m);
    for (int round = 0; m.closures > 0 && round < rounds; ++round) close_loops(m);
  }
  template <Pass pass>
  FATHOM_HD void substitute(const Mechanism& m) const {
    from_leaves(m, [&](std::uint32_t i) { hand_on<pass>(i); });
    from_root(m, [&](std::uint32_t i) { follow_parent<pass>(i); });
  }
  template <Pass pass>
  FATHOM_FLATTEN FATHOM_HD void hand_on(std::uint32_t i) const {
    LinkState& s = states[i];
    for (std::uint32_t c = links[i].end_of_children(); c-- > links[i].first_child;) {
      const LinkState& child = states[c];
      s.load.impulse += child.handed.impulse;
      s.load.moment += child.handed.moment + cross(child.parent_arm, child.handed.impulse);
    }
    if (links[i].generic != none) {
      s.load.moment -= cross(s.arm, s.load.impulse);
      s.handed = generic[links[i].generic].hand_on(s.load, pass == Pass::aimed);
    } else {
      s.load = at_anchor(s.link, s.load);
      if (links[i].parent != none) s.handed = {handed_on(s.link, s.load, error<pass>(s)), {}};
    }
  }
  template <Pass pass>
  FATHOM_HD static Vec3 error(const LinkState& s) {
    return pass == Pass::aimed ? s.error : Vec3{};
  }
  template <Pass pass>
  FATHOM_FLATTEN FATHOM_HD void follow_parent(std::uint32_t i) const {
    LinkState& s = states[i];
    const TreeChange parent = links[i].parent != none ? states[links[i].parent].step : TreeChange{};
    if (links[i].joint == none) {
      s.step = root_change(s.link, s.load);
    } else if (links[i].generic != none) {
      s.step = generic[links[i].generic].follow(parent, pass == Pass::aimed, pass != Pass::probing);
    } else {
      const Vec3 change = parent.linear + cross(parent.angular, s.parent_arm) - error<pass>(s);
      if (pass != Pass::probing) s.impulse += impulse_on(s.link, s.load, change);
      s.step = fathom::follow(s.link, s.load, change);
    }
    s.load = {};
    if (pass == Pass::probing) return;
    s.change.linear += s.step.linear, s.change.angular += s.step.angular;
    s.motion.linear += s.step.linear, s.motion.angular += s.step.angular;
  }

  // --- loops -----------------------------------------------------------------------------------------------------

  FATHOM_HD LoopClosure closure_of(const Mechanism& m) const { return {closures + m.closure_memory, m.closures}; }
  /// The link of a mechanism's copy k.
  FATHOM_HD std::uint32_t copy(const Mechanism& m, std::uint32_t k) const { return levels[m.first_closure() + k]; }
  template <class Act>
  FATHOM_HD static void each_closure(const Mechanism& m, const Act& act) {
    for (std::uint32_t k = team::item(); k < m.closures; k += team::items) act(k);
    team::sync();
  }
  FATHOM_HD void let_closures_go(const Mechanism& m) const {
    const LoopClosure closure = closure_of(m);
    each_closure(m, [&](std::uint32_t k) {
      for (std::uint32_t row = 0; row < closure_rows; ++row) closure.total(closure_rows * k + row) = 0;
    });
  }
  /// How a copy moves against the body, row by row.
  FATHOM_HD static void write_difference(const TreeChange& copy, const TreeChange& body, float (&rows)[closure_rows]) {
    const Vec3 linear = copy.linear - body.linear, angular = copy.angular - body.angular;
    rows[0] = linear.x, rows[1] = linear.y, rows[2] = linear.z;
    rows[3] = angular.x, rows[4] = angular.y, rows[5] = angular.z;
  }
  FATHOM_HD void load_closure(const Mechanism& m, std::uint32_t k, const TreeLoad& load) const {
    const std::uint32_t link = copy(m, k);
    TreeLoad &on_copy = states[link].load, &on_body = states[links[link].original].load;
    on_copy.impulse += load.impulse, on_copy.moment += load.moment;
    on_body.impulse -= load.impulse, on_body.moment -= load.moment;
  }

  /// What each row moves by where another gives a unit: a solution for each, of links without loads.
  FATHOM_HD void find_responses(const Mechanism& m) const {
    const LoopClosure closure = closure_of(m);
    each_closure(m, [&](std::uint32_t k) { begin_closure(m, closure, k); });
    for (std::uint32_t column = 0; column < closure_rows * m.closures; ++column) {
      if (team::is_leader()) {
        const std::uint32_t axis = column % closure_rows;
        const auto unit = [axis](std::uint32_t of) { return axis == of ? 1.0f : 0.0f; };
        load_closure(m, column / closure_rows, {{unit(0), unit(1), unit(2)}, {unit(3), unit(4), unit(5)}});
      }
      team::sync();
      substitute<Pass::probing>(m);
      each_closure(m, [&](std::uint32_t k) {
        float rows[closure_rows];
        write_difference(states[copy(m, k)].step, states[links[copy(m, k)].original].step, rows);
        for (std::uint32_t r = 0; r < closure_rows; ++r) {
          const std::uint32_t row = closure_rows * k + r;
          if (row >= column) closure.response(row, column) = rows[r] + (row == column ? closure.softness(row) : 0.0f);
        }
      });
    }
    closure.factorise();
  }
  FATHOM_HD void begin_closure(const Mechanism& m, const LoopClosure& closure, std::uint32_t k) const {
    const std::uint32_t body = links[copy(m, k)].body;
    const SymMat3& inertia = access.inertia(body);
    for (std::uint32_t r = 0; r < closure_rows; ++r) {
      const float alone = r < 3 ? access.inverse_mass(body) : 1 / max(max(inertia.xx, inertia.yy), inertia.zz);
      closure.softness(closure_rows * k + r) = closure_softness * alone;
      closure.more(closure_rows * k + r) = 0;
    }
  }
  /// Copies have moved as their own joints want: takes away what they have moved against their bodies.
  FATHOM_HD void close_loops(const Mechanism& m) const {
    const LoopClosure closure = closure_of(m);
    each_closure(m, [&](std::uint32_t k) {
      float rows[closure_rows];
      write_difference(states[copy(m, k)].change, states[links[copy(m, k)].original].change, rows);
      for (std::uint32_t r = 0; r < closure_rows; ++r) closure.error(closure_rows * k + r) = rows[r];
    });
    closure.solve();
    if (team::is_leader())  // a body may have two copies
      for (std::uint32_t k = 0; k < m.closures; ++k) load_closure(m, k, closure.load(k));
    team::sync();
    substitute<Pass::closing>(m);
  }

  // --- what rounds aim at, and have found ------------------------------------------------------------------------

  /// How bodies will have turned when the substep is over.
  FATHOM_HD void look_ahead(const Mechanism& m, float h) const {
    each(m, [&](std::uint32_t i) {
      LinkState& s = states[i];
      s.motion.ahead = rotation_by<float>(s.motion.turned_ahead(h));
      if (links[i].parent == none) s.obstacle.ahead = rotation_by<float>(s.obstacle.turned_ahead(h));
    });
  }
  FATHOM_HD void aim_ahead(const Mechanism& m, float h) const {
    each(m, [&](std::uint32_t i) { aim_ahead(i, h); });
  }
  FATHOM_FLATTEN FATHOM_HD void aim_ahead(std::uint32_t i, float h) const {
    if (links[i].joint == none) return;
    if (links[i].generic != none)
      generic[links[i].generic].aim_ahead({states[i].motion, parent_of(i)}, access.push_out_velocity(), h);
    else
      states[i].error = gap_ahead(states[i], parent_of(i), h);
  }
  /// Whether a round would take away no more than this share of the arms.
  FATHOM_HD bool is_aimed_within(std::uint32_t i, float share, float h) const {
    const LinkState& s = states[i];
    if (links[i].joint == none) return true;
    if (links[i].generic != none) return generic[links[i].generic].is_aimed_within(share, h);
    return h * length(s.error) <= share * (length(s.arm) + length(s.parent_arm));
  }
  FATHOM_HD void aim_at_rest(const Mechanism& m, float gap_share, float h) const {
    const float most = access.push_out_velocity();
    each(m, [&](std::uint32_t i) {
      LinkState& s = states[i];
      if (links[i].joint == none) return;
      const LinkMotion& parent = parent_of(i);
      if (links[i].generic != none)
        return generic[links[i].generic].aim_at_rest({s.motion, parent}, gap_share, closing_share, most, h);
      s.error = speed_apart(s, parent);
      if (gap_share > 0) {
        const float least = (closing_share / h) * (length(s.arm) + length(s.parent_arm));
        const Vec3 pull = limited((gap_share / h) * gap(s, parent), min(most, length(s.error) + least));
        s.error = mul_add(s.error + pull, -0.5f * h, s.row.pull);
      }
    });
  }
  /// Whether the arms of the link's body turn by less than rows can tell of in a substep. Beyond that the stiffness of
  /// swings, which goes with the last substep's impulses, would make ever larger ones.
  FATHOM_HD bool turns_slowly(std::uint32_t i, float h) const {
    const Vec3 turn = h * states[i].motion.angular;
    const auto is_slow = [&](Vec3 arm) { return length(cross(turn, arm)) <= max_drift * length(arm); };
    bool all_are = is_slow(states[i].arm);
    for (std::uint32_t c = links[i].first_child; c < links[i].end_of_children(); ++c)
      all_are = all_are && is_slow(states[c].parent_arm);
    return all_are;
  }
  /// Whether joints turn all bodies slowly enough under what they carry for a substep to follow: a body swings about
  /// its anchor under a pull F at r with ω² = F r / I, I being the inertia of it and what hangs on it. An explicit step
  /// follows up to h ω = 2.
  FATHOM_HD bool can_follow(const Mechanism& m, float h) const {
    return all(m, [&](std::uint32_t i) {
      float sum = 0;  // of (h ω)²
      each_pull(i, h, [&](Vec3 arm, float k) { sum += k * response_across(i, normalize(arm)); });
      return sum <= stiffest_swing;
    });
  }
  /// How easily the link's body turns across `axis`, about its anchor, with what hangs on it (1/(kg·m²)).
  FATHOM_HD float response_across(std::uint32_t i, Vec3 axis) const {
    if (links[i].generic != none) return generic[links[i].generic].response_across(axis);
    const SymFactor& m = states[i].link.angular;
    return (m.response({1, 0, 0}) + (m.response({0, 1, 0}) + m.response({0, 0, 1}))) - m.response(axis);
  }
  /// Whether all anchors will meet, and by a way that rows can tell: a body that its joints spin round within a substep
  /// meets them too.
  FATHOM_HD bool do_meet(const Mechanism& m, float h) const {
    return all(m, [&](std::uint32_t i) {
      const LinkState& s = states[i];
      if (!(h * length(s.change.angular) <= max_drift)) return false;
      if (links[i].joint == none) return true;
      const LinkMotion& parent = parent_of(i);
      if (links[i].generic != none) return generic[links[i].generic].meets({s.motion, parent}, meeting_share, h);
      return h * length(gap_ahead(s, parent, h)) <= meeting_share * (length(s.arm) + length(s.parent_arm));
    });
  }
  /// Whether some limit or largest force is another one than the solution took it for.
  FATHOM_HD bool revise(const Mechanism& m, float h) const {
    return !all(m, [&](std::uint32_t i) {
      return links[i].generic == none || !generic[links[i].generic].revise({states[i].motion, parent_of(i)}, h);
    });
  }

  template <bool soft>
  FATHOM_HD void apply_all(const Mechanism& m, float h, bool follows) const {
    each(m, [&](std::uint32_t i) { apply<soft>(i, h, follows); });
    const LoopClosure closure = closure_of(m);
    each_closure(m, [&](std::uint32_t k) {
      for (std::uint32_t row = closure_rows * k; row < closure_rows * (k + 1); ++row)
        closure.total(row) += closure.more(row);
    });
  }
  template <bool soft>
  FATHOM_FLATTEN FATHOM_HD void apply(std::uint32_t i, float h, bool follows) const {
    const MechanismLink& link = links[i];
    LinkState& s = states[i];
    if (!link.is_copy()) access.add_velocity(link.body, s.change.linear, turned_back_by(s.spin, s.change.angular));
    if (link.joint == none) return;
    const Vec3 before = force_of(i);
    Vec3 force = s.impulse, torque;
    if (link.generic != none) {
      JointLink& joint = generic[link.generic];
      force = joint.force_more(), torque = joint.torque_more();
      joint.apply({s.motion, parent_of(i)}, !soft);
    } else {
      s.row.impulse += s.impulse;
      if (!soft) s.row.total += s.row.impulse;
    }
    const bool swings = soft && !follows && may_swing(i);
    Vec3 moment = cross(s.arm, soft ? force_of(i) : force) + (soft ? torque_of(i) : torque);
    if (swings) moment -= stiffness(before, s.arm, h) * across(s.motion.angular, s.arm);
    s.moment = turned_back_by(s.spin, moment) + (soft ? Vec3{} : s.moment);
    if (link.parent == none) return;
    const LinkState& parent = states[link.parent];
    moment = cross(s.parent_arm, soft ? force_of(i) : force) + (soft ? torque_of(i) : torque);
    if (swings) moment += stiffness(-before, s.parent_arm, h) * across(parent.motion.angular, s.parent_arm);
    s.parent_moment = turned_back_by(parent.spin, moment) + (soft ? Vec3{} : s.parent_moment);
  }
};

#undef FATHOM_FLATTEN

}  // namespace fathom
