#include "native/mechanisms.hpp"

#include <hwy/base.h>

#include <algorithm>
#include <utility>

#include "dynamics/integrate.hpp"
#include "dynamics/joint_limits.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

constexpr std::uint32_t max_links = 4096;   // which one thread solves; more are a net or a rope, and left to the sweeps
constexpr int max_revisions = 4;            // of limits and largest forces, in a substep
constexpr int newton_rounds = 3;            // in which anchors come to meet at a substep's end
constexpr float meeting_share = 1e-3f;      // of the arms' lengths, within which they count as met
constexpr float stiffest_swing = 0.1f;      // (h ω)² of a body that swings under what its joints carry
constexpr float projection_share = 0.2f;    // of the gap that is closed where they do not
constexpr std::uint32_t links_a_loop = 8;   // at least: more loops are a net
constexpr float parted_share = 0.01f;       // of arms and radius, beyond which sweeps bring anchors together first
constexpr float max_behind_a_contact = 24;  // times the mass of the body that touches something

Vec3 on_body(bool is_b, Vec3 of_b) { return is_b ? of_b : -of_b; }

bool holds_anchors(const GenericJoint& joint) {
  return joint.axes[0].locked * joint.axes[1].locked * joint.axes[2].locked != 0;
}

float sum_of(Vec3 v) { return v.x + (v.y + v.z); }

}  // namespace

// --- which joints ----------------------------------------------------------------------------------------------

void Mechanisms::update(const ConstraintLayout& layout, bool has_moved) {
  const bool is_current = !is_stale();
  if (!is_current || any_parted_ || is_restored_) {
    keeps_parted_ = is_restored_ && is_current;
    colouring_ = graph_.colouring();
    joint_definitions_ = graph_.joint_definitions();
    find();
    is_restored_ = keeps_parted_ = false;
  } else if (!has_moved) {
    return;
  }
  if (!empty()) order_by_group(layout);
}

bool Mechanisms::is_stale() const {
  return colouring_ != graph_.colouring() || joint_definitions_ != graph_.joint_definitions();
}

void Mechanisms::restore(bool keeps_trees) {
  is_restored_ = keeps_trees;
  any_parted_ = !keeps_trees;
  colouring_ = graph_.colouring();
  joint_definitions_ = graph_.joint_definitions();
}

bool Mechanisms::is_obstacle(std::uint32_t slot) const {
  return bodies_[slot].motion != MotionType::dynamic || state_.flags[slot] & isolated;
}

/// A joint that holds nothing, but drives, does well in sweeps.
bool Mechanisms::can_be_direct(std::uint32_t slot) const {
  const Joint& j = graph_.joint(slot);
  if (!j.in_use || !j.rigid || j.colour == no_colour || j.kind == ConstraintKind::coupling) return false;
  if (j.kind == ConstraintKind::ball_joint) return true;
  return std::ranges::any_of(graph_.generic_joint(slot).axes,
                             [](const GenericAxis<float>& axis) { return axis.locked + axis.limited > 0; });
}

// Trees that hang on something come first, so that what hangs on two things is a loop, cut at the later joint.
void Mechanisms::find() {
  links_.clear();
  generic_.clear();
  mechanisms_.clear();
  order_.clear();
  any_parted_ = false;
  const std::size_t joints = graph_.joint_slots();
  if (joints == 0) return;
  const auto for_each_rigid = [&](const auto& act) {
    for (std::uint32_t slot = 0; slot < joints; ++slot)
      if (can_be_direct(slot)) act(slot, graph_.joint(slot));
  };
  direct_.assign(joints, 0);
  link_of_.assign(state_.size(), none);
  joints_first_.assign(state_.size() + 1, 0);
  for_each_rigid([&](std::uint32_t, const Joint& j) { ++joints_first_[j.a], ++joints_first_[j.b]; });
  count_joints();
  std::uint32_t sum = 0;
  for (std::uint32_t& first : joints_first_) sum += std::exchange(first, sum);
  grow_to(joints_of_, sum);
  std::vector<std::uint32_t> next(joints_first_);
  for_each_rigid([&](std::uint32_t slot, const Joint& j) {
    joints_of_[next[j.a]++] = slot;
    joints_of_[next[j.b]++] = slot;
  });
  for_each_rigid([&](std::uint32_t slot, const Joint& j) {
    if (is_obstacle(j.a) && !is_obstacle(j.b) && link_of_[j.b] == none) grow_tree(j.b, slot);
    if (is_obstacle(j.b) && !is_obstacle(j.a) && link_of_[j.a] == none) grow_tree(j.a, slot);
  });
  for (const std::uint32_t root : free_roots())
    if (link_of_[root] == none) grow_tree(root, none);
  order_.resize(mechanisms_.size());
  for (std::uint32_t i = 0; i < order_.size(); ++i) order_[i] = i;
  states_.resize(links_.size());
}

// The heaviest first: the inertia of a light root would be lost beside that of what hangs on it.
std::vector<std::uint32_t> Mechanisms::free_roots() const {
  std::vector<std::uint32_t> roots;
  for (std::uint32_t slot = 0; slot < state_.size(); ++slot)
    if (joints_first_[slot] < joints_first_[slot + 1] && !is_obstacle(slot) && link_of_[slot] == none)
      roots.push_back(slot);
  std::ranges::stable_sort(roots, {}, [this](std::uint32_t slot) { return bodies_[slot].inverse_mass; });
  return roots;
}

void Mechanisms::count_joints() {
  joint_colours_.assign(state_.size(), {});
  for (std::uint32_t slot = 0; slot < graph_.joint_slots(); ++slot) {
    const Joint& j = graph_.joint(slot);
    if (!j.in_use || j.colour == no_colour) continue;
    for (const std::uint32_t body : {j.a, j.b}) {
      if (j.kind == ConstraintKind::coupling) joint_colours_[body].is_coupled = true;
      if (j.colour == overflow_colour)
        ++joint_colours_[body].overflow;
      else
        joint_colours_[body].mask |= 1u << j.colour;
    }
  }
}

bool Mechanisms::is_in_contact(std::uint32_t slot) const {
  const JointColours& joints = joint_colours_[slot];
  return (state_.colour_mask[slot] & ~joints.mask) != 0 || state_.overflow_count[slot] > joints.overflow;
}

// A contact's rows know its two bodies' masses, not what a direct solution moves with them. Pressed by far more, they
// need that many sweeps to stop it and as many to let go, and in between throw it back: a ball of 500 kg on links of
// 2 kg that was caught among crates gained energy without end.
bool Mechanisms::leans_on_light_bodies(std::uint32_t first) const {
  float mass = 0, lightest = 3e38f;
  for (std::uint32_t i = first; i < links_.size(); ++i) {
    const float of_body = 1 / bodies_[links_[i].slot].inverse_mass;
    mass += of_body;
    if (is_in_contact(links_[i].slot)) lightest = min(lightest, of_body);
  }
  return mass > max_behind_a_contact * lightest;
}

// A coupling's row and a direct solution of what it pushes would take turns against each other: a motor and a brake at
// two wheels come to terms in sweeps alone.
bool Mechanisms::is_coupled(std::uint32_t first) const {
  return std::any_of(links_.begin() + first, links_.end(),
                     [this](const Link& link) { return joint_colours_[link.slot].is_coupled; });
}

// What sweeps have let part they draw together again: a direct solution would throw it.
bool Mechanisms::has_parted(std::uint32_t first) const {
  for (std::uint32_t i = first; i < links_.size(); ++i) {
    if (links_[i].joint == none) continue;
    const Joint& j = graph_.joint(links_[i].joint);
    if (j.kind == ConstraintKind::generic_joint && !holds_anchors(graph_.generic_joint(links_[i].joint))) continue;
    const float gap = distance(transform(state_.poses[j.a], j.anchor_a), transform(state_.poses[j.b], j.anchor_b));
    const float size = length(j.anchor_a) + length(j.anchor_b) + bodies_[links_[i].slot].radius;
    if (gap > parted_share * size) return true;
  }
  return false;
}

void Mechanisms::grow_tree(std::uint32_t root_slot, std::uint32_t root_joint) {
  const auto first = static_cast<std::uint32_t>(links_.size());
  const auto add = [&](std::uint32_t slot, std::uint32_t joint, std::uint32_t parent) {
    const bool is_b = joint != none && graph_.joint(joint).b == slot;
    const std::uint32_t other = joint == none ? none : is_b ? graph_.joint(joint).a : graph_.joint(joint).b;
    link_of_[slot] = static_cast<std::uint32_t>(links_.size());
    std::uint32_t generic = none;
    if (joint != none && graph_.joint(joint).kind == ConstraintKind::generic_joint) {
      generic = static_cast<std::uint32_t>(generic_.size());
      generic_.emplace_back();
    }
    links_.push_back({slot, joint, parent, parent == none ? other : none, generic, is_b, joint != none});
    if (parent != none) ++links_[parent].joints;
    if (joint != none) direct_[joint] = undriven;
  };
  add(root_slot, root_joint, none);
  std::uint32_t ends = 0;  // of joints that are no links: a loop has both of its ends here, or one at an obstacle
  for (std::uint32_t i = first; i < links_.size(); ++i) {
    const std::uint32_t slot = links_[i].slot;
    for (std::uint32_t k = joints_first_[slot]; k < joints_first_[slot + 1]; ++k) {
      const std::uint32_t joint = joints_of_[k];
      if (direct_[joint]) continue;
      const Joint& j = graph_.joint(joint);
      const std::uint32_t other = j.a == slot ? j.b : j.a;
      if (is_obstacle(other))
        ends += 2;
      else if (link_of_[other] == none)
        add(other, joint, i);
      else
        ++ends;
    }
  }
  const auto count = static_cast<std::uint32_t>(links_.size()) - first;
  const bool parted = !keeps_parted_ && has_parted(first);
  any_parted_ = any_parted_ || parted;
  if (count <= max_links && ends / 2 * links_a_loop <= count && !leans_on_light_bodies(first) && !parted &&
      !is_coupled(first)) {
    mechanisms_.push_back({first, first + count});
    const auto is_driven = [this](const Link& link) { return link.joint != none && graph_.is_driven(link.joint); };
    if (std::any_of(links_.begin() + first, links_.end(), is_driven))
      for (std::uint32_t i = first; i < links_.size(); ++i)
        if (links_[i].joint != none) direct_[links_[i].joint] = driven;
    return;
  }
  for (std::uint32_t i = first; i < links_.size(); ++i)
    if (links_[i].joint != none) direct_[links_[i].joint] = 0;
  links_.resize(first);  // their bodies stay marked, so that nobody looks again
}

void Mechanisms::order_by_group(const ConstraintLayout& layout) {
  first_of_group_.clear();
  if (layout.groups().empty()) return;
  group_of_.assign(state_.size(), 0);
  for (std::uint32_t g = 0; g < layout.groups().size(); ++g)
    for (const std::uint32_t slot : layout.bodies(layout.groups()[g])) group_of_[slot] = g;
  const auto group = [&](std::uint32_t mechanism) { return group_of_[links_[mechanisms_[mechanism].first].slot]; };
  std::stable_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) { return group(a) < group(b); });
  std::uint32_t next = 0;
  for (std::uint32_t g = 0; g < layout.groups().size(); ++g) {
    first_of_group_.push_back(next);
    while (next < order_.size() && group(order_[next]) == g) ++next;
  }
  first_of_group_.push_back(next);
}

// --- a step ----------------------------------------------------------------------------------------------------

void Mechanisms::prepare(std::uint32_t mechanism) {
  for (std::uint32_t i = mechanisms_[mechanism].first; i < mechanisms_[mechanism].end; ++i) {
    LinkState& s = states_[i];
    s = {};
    s.mass = 1 / state_.solver_bodies()[links_[i].slot].inverse_mass;
    if (links_[i].joint == none) continue;
    if (links_[i].parent == none) {
      const SolverBody& obstacle = state_.solver_bodies()[links_[i].obstacle];
      s.obstacle = {{}, {}, obstacle.linear, obstacle.angular};
    }
    if (links_[i].generic == none)
      prepare_ball(i);
    else
      prepare_generic(i);
    s.moment = cross(s.arm, force_of(i)) + torque_of(i);
    s.parent_moment = cross(s.parent_arm, force_of(i)) + torque_of(i);
  }
}

static UnitQuat<float> rotation(const Pose& pose) { return {pose.rotation.w, pose.rotation.vector()}; }

static Vec3 swing_acceleration(const BodyState& state, std::uint32_t slot) {
  return state.swings[slot] ? state.motion[slot].acceleration : Vec3{};
}

void Mechanisms::prepare_ball(std::uint32_t i) {
  const Link& link = links_[i];
  LinkState& s = states_[i];
  const Joint& j = graph_.joint(link.joint);
  const std::uint32_t parent = link.is_b ? j.a : j.b;
  const Pose &of_parent = state_.poses[parent], &of_body = state_.poses[link.slot];
  prepare_ball_joint<float>(rotation(of_parent), rotation(of_body), of_body.position - of_parent.position,
                            link.is_b ? j.anchor_a : j.anchor_b, link.is_b ? j.anchor_b : j.anchor_a,
                            on_body(link.is_b, graph_.constrained().joint_impulses[link.joint].last), s.row);
  s.row.pull = swing_acceleration(state_, link.slot) - swing_acceleration(state_, parent);
  s.arm = s.row.arm_b, s.parent_arm = s.row.arm_a;
}

void Mechanisms::prepare_generic(std::uint32_t i) {
  const Joint& j = graph_.joint(links_[i].joint);
  const GenericJoint& generic = graph_.generic_joint(links_[i].joint);
  const Pose &a = state_.poses[j.a], &b = state_.poses[j.b];
  GenericJointRow<float> row{};
  prepare_generic_joint<float>(rotation(a), rotation(b), b.position - a.position, generic.on_a, generic.on_b,
                               j.anchor_a, j.anchor_b, row);
  row.pull = swing_acceleration(state_, j.b) - swing_acceleration(state_, j.a);
  if (generic.reacts != 0) {
    const JointBodies<SymMat3> bodies = bodies_of(i);
    begin_rates(row, generic, bodies.a, bodies.b);
  }
  JointLink& link = generic_[links_[i].generic];
  link.begin(generic, links_[i].is_b, row, graph_.generic_impulse(links_[i].joint));
  states_[i].arm = link.arm(), states_[i].parent_arm = link.parent_arm();
}

Vec3 Mechanisms::force_of(std::uint32_t i) const {
  return links_[i].generic == none ? states_[i].row.impulse : generic_[links_[i].generic].force();
}
Vec3 Mechanisms::torque_of(std::uint32_t i) const {
  return links_[i].generic == none ? Vec3{} : generic_[links_[i].generic].torque();
}
bool Mechanisms::may_swing(std::uint32_t i) const {
  return links_[i].joint != none && (links_[i].generic == none || !generic_[links_[i].generic].is_stiff());
}

void Mechanisms::warm_start(std::uint32_t mechanism, bool forgets) {
  const auto push = [&](std::uint32_t slot, Vec3 impulse, Vec3 moment) {
    SolverBody& body = state_.solver_bodies()[slot];
    const WorldInertia& w = state_.inertia[slot];
    const bool is_anisotropic = body.inverse_mass > 0 && body.inverse_inertia == 0;
    body.linear = mul_add(body.linear, body.inverse_mass, impulse);
    body.angular +=
        is_anisotropic ? SymMat3{w.xx, w.yy, w.zz, w.xy, w.xz, w.yz} * moment : body.inverse_inertia * moment;
  };
  const Mechanism& m = mechanisms_[mechanism];
  if (forgets) return forget(m);
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    const Link& link = links_[i];
    if (link.joint == none) continue;
    push(link.slot, force_of(i), states_[i].moment);
    if (link.parent != none) push(links_[link.parent].slot, -force_of(i), -states_[i].parent_moment);
  }
}

/// Where a link's body is now, how it moves, and what it resists that with.
HWY_FLATTEN void Mechanisms::turn(LinkState& s, const Link& link) const {
  const SolverBody& body = state_.solver_bodies()[link.slot];
  const BodyInfo& info = bodies_[link.slot];
  s.turned = rotation_by<float>(body.turned);
  s.spin = info.isotropic ? UnitQuat<float>{1, {}} : s.turned;
  s.motion = {body.moved, body.turned, body.linear, turned_by(s.spin, body.angular), info.isotropic};
  s.change = {}, s.impulse = {}, s.load = {};
  const float scale = s.mass * info.inverse_mass;  // of the inertia that loads have added
  Mat3 inertia = diagonal(scale * info.inertia.xx);
  if (!info.isotropic) {
    const Quat now = Quat{s.turned.w, s.turned.v.x, s.turned.v.y, s.turned.v.z} * state_.poses[link.slot].rotation;
    inertia = to_matrix(scale * rotated(to_matrix(now), info.inertia));
  }
  s.inertia = max(inertia.x.x, max(inertia.y.y, inertia.z.z));
  s.of_body = tree_inertia(s.mass, inertia);
}

/// Of a link's parent or of what it hangs on.
const LinkMotion& Mechanisms::parent_of(std::uint32_t i) const {
  return links_[i].parent != none ? states_[links_[i].parent].motion : states_[i].obstacle;
}

/// On by a substep of length h (s), as bodies are.
void Mechanisms::move_obstacles(const Mechanism& m, float h) {
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    LinkMotion& obstacle = states_[i].obstacle;
    obstacle.moved = mul_add(obstacle.moved, h, obstacle.linear);
    obstacle.turned = mul_add(obstacle.turned, h, obstacle.angular);
  }
}

/// How fast the anchors run away from each other.
Vec3 Mechanisms::speed_apart(const LinkState& s, const LinkMotion& parent) {
  return (s.motion.linear + cross(s.motion.angular, s.arm)) - (parent.linear + cross(parent.angular, s.parent_arm));
}

/// How far they are apart.
Vec3 Mechanisms::gap(const LinkState& s, const LinkMotion& parent) {
  return s.row.gap + ((s.motion.moved + (s.arm - s.row.arm_b)) - (parent.moved + (s.parent_arm - s.row.arm_a)));
}

/// How far they will be apart when the bodies have moved on for h (s), over h.
// With rotations and products in line: called, their arguments pass through memory, which costs more than they do.
HWY_FLATTEN Vec3 Mechanisms::gap_ahead(const LinkState& s, const LinkMotion& parent, float h) {
  const auto anchor_ahead = [h](const LinkMotion& m, Vec3 arm) {
    const UnitQuat<float> turned = rotation_by<float>(m.turned_ahead(h));
    return mul_add(m.moved, h, m.linear) + (turned_by(turned, arm) - arm);
  };
  const Vec3 gap = s.row.gap + (anchor_ahead(s.motion, s.row.arm_b) - anchor_ahead(parent, s.row.arm_a));
  return mul_add((1 / h) * gap, -0.5f * h, s.row.pull);
}

/// Moments of what bodies have carried over, about arms that have turned since.
HWY_FLATTEN void Mechanisms::load_carried(const Mechanism& m) {
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    LinkState& s = states_[i];
    if (links_[i].joint == none) continue;
    s.load.moment += cross(s.arm, force_of(i)) + torque_of(i) - turned_by(s.spin, s.moment);
    if (links_[i].parent == none) continue;
    LinkState& parent = states_[links_[i].parent];
    parent.load.moment -= cross(s.parent_arm, force_of(i)) + torque_of(i) - turned_by(parent.spin, s.parent_moment);
  }
}

/// The pull of an impulse on a body that turns about the anchor it acts on: what it takes of the angular velocity
/// within a substep of length h (kg·m²), and of which velocity.
static float stiffness(Vec3 impulse, Vec3 arm, float h) { return h * max(dot(impulse, arm), 0.0f); }
static Vec3 across(Vec3 angular, Vec3 arm) {
  const Vec3 axis = normalize(arm);
  return angular - dot(axis, angular) * axis;
}

void Mechanisms::stiffen(const Mechanism& m, float h) {
  const auto add = [](LinkState& body, Vec3 arm, float k) {
    const Vec3 axis = normalize(arm);
    const Mat3 outer{axis.x * axis, axis.y * axis, axis.z * axis};
    body.of_body.angular = body.of_body.angular + k * (diagonal(1) - outer);
    body.load.moment -= k * across(body.motion.angular, arm);
  };
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    LinkState& s = states_[i];
    if (!may_swing(i)) continue;
    add(s, s.arm, stiffness(force_of(i), s.arm, h));
    if (links_[i].parent != none)
      add(states_[links_[i].parent], s.parent_arm, stiffness(-force_of(i), s.parent_arm, h));
  }
}

/// The loads of `stiffen` alone.
void Mechanisms::stiffen_load(const Mechanism& m, float h) {
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    LinkState& s = states_[i];
    if (!may_swing(i)) continue;
    s.load.moment -= stiffness(force_of(i), s.arm, h) * across(s.motion.angular, s.arm);
    if (links_[i].parent == none) continue;
    LinkState& p = states_[links_[i].parent];
    p.load.moment -= stiffness(-force_of(i), s.parent_arm, h) * across(p.motion.angular, s.parent_arm);
  }
}

JointBodies<SymMat3> Mechanisms::bodies_of(std::uint32_t i) const {
  const Link& link = links_[i];
  const Joint& j = graph_.joint(link.joint);
  const auto side = [&](std::uint32_t slot) {
    if (slot != link.slot && link.parent == none) {
      const LinkMotion& m = states_[i].obstacle;
      return JointBodies<SymMat3>::Side{m.linear, m.angular, m.moved, m.turned, 0, 0, {}};
    }
    const SolverBody& body = state_.solver_bodies()[slot];
    const WorldInertia& w = state_.inertia[slot];
    const float inverse = body.inverse_inertia;
    const SymMat3 response = body.inverse_mass > 0 && inverse == 0 ? SymMat3{w.xx, w.yy, w.zz, w.xy, w.xz, w.yz}
                                                                   : SymMat3{inverse, inverse, inverse, 0, 0, 0};
    return JointBodies<SymMat3>::Side{body.linear,       body.angular, body.moved, body.turned,
                                      body.inverse_mass, inverse,      response};
  };
  return {side(j.a), side(j.b)};
}

HWY_FLATTEN void Mechanisms::turn_all(const Mechanism& m, float h, bool relaxes) {
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    LinkState& s = states_[i];
    const Link& link = links_[i];
    turn(s, link);
    if (link.joint == none) continue;
    if (link.generic != none) {
      JointLink& generic = generic_[link.generic];
      generic.look(bodies_of(i), h, relaxes);
      generic.choose_coordinates({s.motion, parent_of(i)});
      s.arm = generic.arm(), s.parent_arm = generic.parent_arm();
      continue;
    }
    s.arm = turned_by(s.turned, s.row.arm_b);
    s.parent_arm = turned_by(
        link.parent != none ? states_[link.parent].turned : rotation_by<float>(parent_of(i).turned), s.row.arm_a);
  }
}

void Mechanisms::eliminate(const Mechanism& m) {
  for (std::uint32_t i = m.end; i-- > m.first;) {
    LinkState& s = states_[i];
    TreeInertia* const parent = links_[i].parent != none ? &states_[links_[i].parent].of_body : nullptr;
    if (links_[i].generic != none) {
      generic_[links_[i].generic].eliminate(s.of_body, parent);
      continue;
    }
    s.link = tree_link(s.of_body, s.arm);
    if (parent) add_child(*parent, s.link, s.parent_arm);
  }
}

/// Takes away all links' errors under their loads.
void Mechanisms::substitute(const Mechanism& m) {
  for (std::uint32_t i = m.end; i-- > m.first;) {
    LinkState& s = states_[i];
    TreeLoad handed;
    if (links_[i].generic != none) {
      s.load.moment -= cross(s.arm, s.load.impulse);
      handed = generic_[links_[i].generic].hand_on(s.load);
    } else {
      s.load = at_anchor(s.link, s.load);
      if (links_[i].parent != none) handed = {handed_on(s.link, s.load, s.error), {}};
    }
    if (links_[i].parent == none) continue;
    TreeLoad& parent = states_[links_[i].parent].load;
    parent.impulse += handed.impulse;
    parent.moment += handed.moment + cross(s.parent_arm, handed.impulse);
  }
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    LinkState& s = states_[i];
    const TreeChange parent = links_[i].parent != none ? states_[links_[i].parent].step : TreeChange{};
    if (links_[i].joint == none) {
      s.step = root_change(s.link, s.load);
    } else if (links_[i].generic != none) {
      s.step = generic_[links_[i].generic].follow(parent);
    } else {
      const Vec3 change = parent.linear + cross(parent.angular, s.parent_arm) - s.error;
      s.impulse += impulse_on(s.link, s.load, change);
      s.step = follow(s.link, s.load, change);
    }
    s.change.linear += s.step.linear, s.change.angular += s.step.angular;
    s.motion.linear += s.step.linear, s.motion.angular += s.step.angular;
    s.load = {};
  }
}

/// The bodies' velocities as they were before rounds.
void Mechanisms::take_back(const Mechanism& m) {
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    LinkState& s = states_[i];
    s.motion.linear -= s.change.linear, s.motion.angular -= s.change.angular;
    s.change = {}, s.impulse = {}, s.load = {};
    if (links_[i].generic != none) generic_[links_[i].generic].take_back();
  }
}

/// Whether joints turn all bodies slowly enough under what they carry for a substep to follow: a body swings about its
/// anchor under a pull F with ω² = F r / I, which an explicit step follows up to h ω = 2.
bool Mechanisms::can_follow(const Mechanism& m, float h) const {
  bool can = true;
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    const LinkState& s = states_[i];
    if (!may_swing(i)) continue;
    const float pull = h * length(force_of(i));  // h² F
    // At the end of a chain a body swings with all its mass.
    const auto swings_slowly = [&](std::uint32_t link, Vec3 arm) {
      const LinkState& body = states_[link];
      const float own = links_[link].joints > 1 ? body.inertia : fma(body.mass, length_squared(arm), body.inertia);
      return pull * length(arm) <= stiffest_swing * own;
    };
    can = can && swings_slowly(i, s.arm);
    if (links_[i].parent != none) can = can && swings_slowly(links_[i].parent, s.parent_arm);
  }
  return can;
}

/// Whether all anchors will meet, and by a way that rows can tell: a body that its joints spin round within a substep
/// meets them too.
bool Mechanisms::do_meet(const Mechanism& m, float h) const {
  bool do_all = true;
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    const LinkState& s = states_[i];
    do_all = do_all && h * length(s.change.angular) <= max_drift;
    if (links_[i].joint == none) continue;
    const LinkMotion parent = parent_of(i);
    const float reach = meeting_share * (length(s.arm) + length(s.parent_arm));
    do_all =
        do_all && (links_[i].generic != none ? generic_[links_[i].generic].meets({s.motion, parent}, h, meeting_share)
                                             : h * length(gap_ahead(s, parent, h)) <= reach);
  }
  return do_all;
}

/// Whether some limit or largest force is another one than the solution took it for.
bool Mechanisms::revise(const Mechanism& m, float h) {
  bool any = false;
  for (std::uint32_t i = m.first; i < m.end; ++i)
    if (links_[i].generic != none)
      any = generic_[links_[i].generic].revise({states_[i].motion, parent_of(i)}, h) || any;
  return any;
}

void Mechanisms::aim_ahead(const Mechanism& m, float h) {
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    LinkState& s = states_[i];
    if (links_[i].joint == none) continue;
    const LinkMotion parent = parent_of(i);
    if (links_[i].generic != none)
      generic_[links_[i].generic].aim_ahead({s.motion, parent}, h);
    else
      s.error = gap_ahead(s, parent, h);
  }
}

void Mechanisms::aim_at_rest(const Mechanism& m, float gap_share, float h) {
  const float most = def_.solver.push_out_velocity;
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    LinkState& s = states_[i];
    if (links_[i].joint == none) continue;
    const LinkMotion parent = parent_of(i);
    if (links_[i].generic != none) {
      generic_[links_[i].generic].aim_at_rest({s.motion, parent}, gap_share, most, h);
      continue;
    }
    s.error = speed_apart(s, parent);
    if (gap_share > 0)
      s.error = mul_add(s.error + limited((gap_share / h) * gap(s, parent), most), -0.5f * h, s.row.pull);
  }
}

template <bool soft>
void Mechanisms::solve_once(const Mechanism& m, float h, bool follows) {
  if constexpr (soft) {
    load_carried(m);
    if (!follows) stiffen(m, h);
  }
  eliminate(m);
  if constexpr (soft) {
    for (int round = 0; round < newton_rounds; ++round) {
      aim_ahead(m, h);
      substitute(m);
    }
  } else {
    aim_at_rest(m, 0, h);
    substitute(m);
  }
}

template <bool soft>
void Mechanisms::solve(std::uint32_t mechanism, float h) {
  const Mechanism m = mechanisms_[mechanism];
  turn_all(m, h, !soft);
  bool follows = !soft || can_follow(m, h);
  solve_once<soft>(m, h, follows);
  for (int revision = 0; soft && revision < max_revisions && revise(m, h); ++revision) {
    turn_all(m, h, false);
    follows = can_follow(m, h);
    solve_once<soft>(m, h, follows);
  }
  if (soft && !do_meet(m, h)) {
    take_back(m);
    load_carried(m);
    if (!follows) stiffen_load(m, h);
    aim_at_rest(m, projection_share, h);
    substitute(m);
  }
  float sum = 0;
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    sum += sum_of(states_[i].change.linear + states_[i].change.angular) + sum_of(states_[i].impulse);
    if (const std::uint32_t generic = links_[i].generic; generic != none)
      sum += sum_of(generic_[generic].force_more() + generic_[generic].torque_more());
  }
  if (is_finite(sum))
    apply<soft>(m, h, follows);
  else
    forget(m);
}

template <bool soft>
HWY_FLATTEN void Mechanisms::apply(const Mechanism& m, float h, bool follows) {
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    LinkState& s = states_[i];
    SolverBody& body = state_.solver_bodies()[links_[i].slot];
    body.linear += s.change.linear;
    body.angular += turned_back_by(s.spin, s.change.angular);
    if (links_[i].joint == none) continue;
    const Vec3 before = force_of(i);
    Vec3 force = s.impulse, torque;
    if (links_[i].generic != none) {
      JointLink& generic = generic_[links_[i].generic];
      force = generic.force_more(), torque = generic.torque_more();
      generic.apply({s.motion, parent_of(i)}, !soft);
    } else {
      s.row.impulse += s.impulse;
      if (!soft) s.row.total += s.row.impulse;
    }
    const bool swings = soft && !follows && may_swing(i);
    Vec3 moment = cross(s.arm, soft ? force_of(i) : force) + (soft ? torque_of(i) : torque);
    if (swings) moment -= stiffness(before, s.arm, h) * across(s.motion.angular, s.arm);
    s.moment = turned_back_by(s.spin, moment) + (soft ? Vec3{} : s.moment);
    if (links_[i].parent == none) continue;
    const LinkState& parent = states_[links_[i].parent];
    moment = cross(s.parent_arm, soft ? force_of(i) : force) + (soft ? torque_of(i) : torque);
    if (swings) moment += stiffness(-before, s.parent_arm, h) * across(parent.motion.angular, s.parent_arm);
    s.parent_moment = turned_back_by(parent.spin, moment) + (soft ? Vec3{} : s.parent_moment);
  }
}

/// What is not finite of one body reaches no other.
void Mechanisms::forget(const Mechanism& m) {
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    BallJointRow<float>& row = states_[i].row;
    row.impulse = row.total = states_[i].moment = states_[i].parent_moment = {};
    if (links_[i].generic != none) generic_[links_[i].generic].forget();
  }
}

void Mechanisms::store(std::uint32_t mechanism) {
  const Constrained constrained = graph_.constrained();
  for (std::uint32_t i = mechanisms_[mechanism].first; i < mechanisms_[mechanism].end; ++i) {
    const Link& link = links_[i];
    if (link.joint == none) continue;
    if (link.generic != none) {
      constrained.generic_impulses[link.joint] = generic_[link.generic].impulse();
      continue;
    }
    const BallJointRow<float>& row = states_[i].row;
    constrained.joint_impulses[link.joint] = {on_body(link.is_b, row.impulse), on_body(link.is_b, row.total)};
  }
}

std::size_t Mechanisms::memory_bytes() const {
  return links_.capacity() * sizeof(Link) + generic_.capacity() * sizeof(JointLink) +
         states_.capacity() * sizeof(LinkState) + mechanisms_.capacity() * sizeof(Mechanism) + direct_.capacity() +
         joint_colours_.capacity() * sizeof(JointColours) +
         (order_.capacity() + first_of_group_.capacity() + link_of_.capacity() + joints_first_.capacity() +
          joints_of_.capacity() + group_of_.capacity()) *
             sizeof(std::uint32_t);
}

template void Mechanisms::solve<true>(std::uint32_t, float);
template void Mechanisms::solve<false>(std::uint32_t, float);

}  // namespace fathom::native
