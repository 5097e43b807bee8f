#include "native/mechanisms.hpp"

#include <algorithm>
#include <bit>

namespace fathom::native {

/// Bodies and joints by their slots.
struct Mechanisms::Access {
  struct Ends {
    std::uint32_t a, b;
    Vec3 anchor_a, anchor_b;
  };

  const WorldDef& def;
  const BodyTable& bodies;
  BodyState& state;
  ContactGraph& graph;
  SolverBody* solver_bodies;

  const SolverBody& body(std::uint32_t i) const { return solver_bodies[i]; }
  void set_velocity(std::uint32_t i, Vec3 linear, Vec3 angular) const {
    solver_bodies[i].linear = linear, solver_bodies[i].angular = angular;
  }
  void add_velocity(std::uint32_t i, Vec3 linear, Vec3 angular) const {
    solver_bodies[i].linear += linear, solver_bodies[i].angular += angular;
  }
  bool is_isotropic(std::uint32_t i) const { return bodies[i].isotropic; }
  float inverse_mass(std::uint32_t i) const { return bodies[i].inverse_mass; }
  const SymMat3& inertia(std::uint32_t i) const { return bodies[i].inertia; }
  const Pose& pose(std::uint32_t i) const { return state.poses[i]; }
  SymMat3 response(std::uint32_t i, const SolverBody& body) const {
    const float inverse = body.inverse_inertia;
    if (!(body.inverse_mass > 0 && inverse == 0)) return {inverse, inverse, inverse, 0, 0, 0};
    const WorldInertia& w = state.inertia[i];
    return {w.xx, w.yy, w.zz, w.xy, w.xz, w.yz};
  }
  Vec3 swing(const MechanismLink& link) const {
    return state.swings[link.body] ? state.motion[link.body].acceleration : Vec3{};
  }
  Ends joint(std::uint32_t j) const {
    const Joint& joint = graph.joint(j);
    return {joint.a, joint.b, joint.anchor_a, joint.anchor_b};
  }
  Vec3 last_impulse(std::uint32_t j) const { return graph.constrained().joint_impulses[j].last; }
  const GenericJoint& generic(std::uint32_t j) const { return graph.generic_joint(j); }
  const GenericImpulse& generic_impulse(std::uint32_t j) const { return graph.generic_impulse(j); }
  void store(std::uint32_t j, Vec3 last, Vec3 total) const { graph.constrained().joint_impulses[j] = {last, total}; }
  void store(std::uint32_t j, const GenericImpulse& impulse) const {
    graph.constrained().generic_impulses[j] = impulse;
  }
  float push_out_velocity() const { return def.solver.push_out_velocity; }
  SpeedLimits limits(float h) const { return speed_limits(def.solver.max_linear_speed, h); }
};

/// Joints of which both bodies are awake, or one that hangs on an obstacle.
struct Mechanisms::Source {
  Mechanisms& m;

  std::uint32_t bodies() const { return static_cast<std::uint32_t>(m.state_.size()); }
  std::uint32_t joints() const { return static_cast<std::uint32_t>(m.graph_.joint_slots()); }
  /// A joint that holds nothing, but drives, does well in sweeps.
  bool is_candidate(std::uint32_t slot) const {
    const Joint& j = m.graph_.joint(slot);
    if (!j.in_use || !j.rigid || j.colour == no_colour || j.kind == ConstraintKind::coupling) return false;
    return j.kind == ConstraintKind::ball_joint || m.graph_.generic_joint(slot).holds();
  }
  std::uint32_t a(std::uint32_t slot) const { return m.graph_.joint(slot).a; }
  std::uint32_t b(std::uint32_t slot) const { return m.graph_.joint(slot).b; }
  bool is_generic(std::uint32_t slot) const { return m.graph_.joint(slot).kind == ConstraintKind::generic_joint; }
  bool is_driven(std::uint32_t slot) const { return m.graph_.is_driven(slot); }
  bool is_stiff(std::uint32_t slot) const { return is_generic(slot) && m.graph_.generic_joint(slot).is_stiff(); }
  bool is_obstacle(std::uint32_t slot) const {
    return m.bodies_[slot].motion != MotionType::dynamic || m.state_.flags[slot] & isolated;
  }
  float inverse_mass(std::uint32_t slot) const { return m.bodies_[slot].inverse_mass; }
  bool may_collide(std::uint32_t slot) const { return fathom::may_collide(m.bodies_[slot]); }
  bool accepts(std::span<const MechanismLink> tree) const { return m.accepts(tree); }
};

MechanismSolver<Mechanisms::Access> Mechanisms::solver() {
  return {{def_, bodies_, state_, graph_, state_.solver_bodies()},
          trees_.links().data(),
          trees_.levels().data(),
          states_.data(),
          generic_.data(),
          closures_.data()};
}

void Mechanisms::prepare(std::uint32_t number) { solver().prepare(mechanism(number)); }
void Mechanisms::warm_start(std::uint32_t number, float h, bool forgets) {
  solver().warm_start(mechanism(number), h, forgets);
}
void Mechanisms::pull_together(std::uint32_t number, float h) { solver().pull_together(mechanism(number), h); }
void Mechanisms::relax(std::uint32_t number, float h) { solver().relax(mechanism(number), h); }
void Mechanisms::store(std::uint32_t number) { solver().store(mechanism(number)); }

void Mechanisms::note_swings(std::uint32_t number) {
  const Mechanism& m = mechanism(number);
  const bool swings = does_swing(m);
  for (std::uint32_t i = m.first; i < m.end; ++i) state_.swings[trees_.links()[i].body] = swings;
}

/// A mechanism of which some body rests on something would come to rest with the velocity that the others are to have
/// between positions; so would one that drives move, which aim at a velocity.
bool Mechanisms::does_swing(const Mechanism& m) const {
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    const MechanismLink& link = trees_.links()[i];
    if (link.joint != MechanismLink::none && trees_.direct()[link.joint] == JointTrees::driven) return false;
    if (link.is_copy()) continue;
    if (constraints_of(link.body) != link.joints() || state_.flags[link.body] & has_force) return false;
  }
  return true;
}

// --- which joints ----------------------------------------------------------------------------------------------

void Mechanisms::update(const ConstraintLayout& layout, bool has_moved) {
  if (!def_.solver.direct_joints) return;
  if (is_stale()) {
    is_to_find_ = false;
    colouring_ = graph_.colouring();
    joint_definitions_ = graph_.joint_definitions();
    find();
  } else if (!has_moved) {
    return;
  }
  if (!empty()) order_by_group(layout);
}

bool Mechanisms::is_stale() const {
  return is_to_find_ || colouring_ != graph_.colouring() || joint_definitions_ != graph_.joint_definitions();
}

void Mechanisms::find() {
  for (const MechanismLink& link : trees_.links())
    if (link.body < state_.size()) state_.swings[link.body] = 0;
  if (graph_.joint_slots() > 0) count_joints();
  trees_.find(Source{*this});
  order_.resize(trees_.mechanisms().size());
  for (std::uint32_t i = 0; i < order_.size(); ++i) order_[i] = i;
  states_.resize(trees_.links().size());
  generic_.resize(trees_.generic());
  closures_.resize(trees_.closure_floats());
  find_leaning();
}

void Mechanisms::find_leaning() {
  leaning_.clear();
  for (const MechanismLink& link : trees_.links()) {
    const float inertia = link.min_inertia(bodies_[link.body].inverse_mass);
    if (inertia > 1 && constraints_of(link.body) > joints_[link.body].count) leaning_.push_back({link.body, inertia});
  }
}

void Mechanisms::count_joints() {
  joints_.assign(state_.size(), {});
  for (std::uint32_t slot = 0; slot < graph_.joint_slots(); ++slot) {
    const Joint& j = graph_.joint(slot);
    if (!j.in_use || j.colour == no_colour) continue;
    for (const std::uint32_t body : {j.a, j.b}) {
      ++joints_[body].count;
      if (j.kind == ConstraintKind::coupling) joints_[body].is_coupled = true;
    }
  }
}

std::uint32_t Mechanisms::constraints_of(std::uint32_t slot) const {
  return static_cast<std::uint32_t>(std::popcount(state_.colour_mask[slot])) + state_.overflow_count[slot];
}

// A coupling's row and a direct solution of what it pushes would take turns against each other: a motor and a brake at
// two wheels come to terms in sweeps alone.
bool Mechanisms::accepts(std::span<const MechanismLink> tree) const {
  return std::ranges::none_of(tree, [this](const MechanismLink& link) { return joints_[link.body].is_coupled; });
}

void Mechanisms::order_by_group(const ConstraintLayout& layout) {
  first_of_group_.clear();
  if (layout.groups().empty()) return;
  group_of_.assign(state_.size(), 0);
  for (std::uint32_t g = 0; g < layout.groups().size(); ++g)
    for (const std::uint32_t slot : layout.bodies(layout.groups()[g])) group_of_[slot] = g;
  const auto group = [&](std::uint32_t number) { return group_of_[trees_.links()[mechanism(number).first].body]; };
  std::stable_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) { return group(a) < group(b); });
  std::uint32_t next = 0;
  for (std::uint32_t g = 0; g < layout.groups().size(); ++g) {
    first_of_group_.push_back(next);
    while (next < order_.size() && group(order_[next]) == g) ++next;
  }
  first_of_group_.push_back(next);
}

std::size_t Mechanisms::memory_bytes() const {
  return trees_.memory_bytes() + states_.capacity() * sizeof(LinkState) + generic_.capacity() * sizeof(JointLink) +
         closures_.capacity() * sizeof(float) + joints_.capacity() * sizeof(Joints) +
         leaning_.capacity() * sizeof(Leaning) +
         (order_.capacity() + first_of_group_.capacity() + group_of_.capacity()) * sizeof(std::uint32_t);
}

}  // namespace fathom::native
