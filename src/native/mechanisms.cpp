#include "native/mechanisms.hpp"

#include <algorithm>
#include <bit>
#include <map>
#include <tuple>

#include "dynamics/torn_joint.hpp"

namespace fathom::native {

namespace {

/// With fewer equal mechanisms, each is faster alone.
constexpr std::size_t min_lanes = 3;

}  // namespace

/// Access to bodies and joints by slot.
struct Mechanisms::Access {
  struct Ends {
    std::uint32_t a, b;
    Vec3 anchor_a, anchor_b;
  };

  const WorldDef& def;
  const BodyTable& bodies;
  BodyState& body_state;
  ContactGraph& graph;
  SolverBody* solver_bodies;
  LinkState* states;
  JointLink* joint_links;
  LinkContacts& link_contacts;
  LinkPushes* by_link;

  LinkState& state(std::uint32_t i) const { return states[i]; }
  JointLink& generic(std::uint32_t number) const { return joint_links[number]; }
  const SolverBody& body(std::uint32_t /*i*/, const MechanismLink& link) const { return solver_bodies[link.body]; }
  const SolverBody& solver_body(std::uint32_t slot) const { return solver_bodies[slot]; }
  void set_velocity(std::uint32_t /*i*/, const MechanismLink& link, Vec3 linear, Vec3 angular) const {
    solver_bodies[link.body].linear = linear, solver_bodies[link.body].angular = angular;
  }
  void add_velocity(std::uint32_t /*i*/, const MechanismLink& link, Vec3 linear, Vec3 angular) const {
    solver_bodies[link.body].linear += linear, solver_bodies[link.body].angular += angular;
  }
  bool is_isotropic(std::uint32_t i) const { return bodies[i].isotropic; }
  float inverse_mass(std::uint32_t i) const { return bodies[i].inverse_mass; }
  float radius(std::uint32_t i) const { return bodies[i].radius; }
  const SymMat3& inertia(std::uint32_t i) const { return bodies[i].inertia; }
  const Pose& pose(std::uint32_t i) const { return body_state.poses[i]; }
  SymMat3 response(std::uint32_t /*i*/, const MechanismLink& link) const {
    const SolverBody& body = solver_bodies[link.body];
    return world_inertia<SymMat3>(body_state.inertia.data(), link.body, body.inverse_mass, body.inverse_inertia);
  }
  bool swings(const MechanismLink& link) const { return body_state.swings[link.body] != 0; }
  Vec3 swing(const MechanismLink& link) const { return body_state.swing(link.body); }
  Ends joint(std::uint32_t j) const {
    const Joint& joint = graph.joint(j);
    return {joint.a, joint.b, joint.anchor_a, joint.anchor_b};
  }
  Vec3 last_impulse(std::uint32_t j) const { return graph.constrained().joint_impulses[j].last; }
  const GenericJoint& generic_joint(std::uint32_t j) const { return graph.generic_joint(j); }
  const GenericImpulse& generic_impulse(std::uint32_t j) const { return graph.generic_impulse(j); }
  void store(std::uint32_t j, Vec3 last, Vec3 total) const { graph.constrained().joint_impulses[j] = {last, total}; }
  void store(std::uint32_t j, const GenericImpulse& impulse) const {
    graph.constrained().generic_impulses[j] = impulse;
  }
  bool solves_contacts(std::uint32_t mechanism) const { return link_contacts.has(mechanism); }
  bool leads_to_contact(std::uint32_t i) const { return link_contacts.leads(i); }
  LinkPushes& pushes(std::uint32_t i) const { return by_link[i]; }
  void move_obstacles(std::uint32_t mechanism, float h) const { link_contacts.move_obstacles(mechanism, h); }
  void begin_contacts(std::uint32_t i, const LinkResponse& response) const { link_contacts.begin(i, response); }
  void end_contacts(std::uint32_t i, bool ends_substep) const {
    link_contacts.store_impulses(link_contacts.of_link(i), ends_substep);
  }
  void take_back_contacts(std::uint32_t i) const { link_contacts.take_back(link_contacts.of_link(i)); }
  bool has_contacts(std::uint32_t i) const { return link_contacts.has_link(i); }
  template <ContactPass pass>
  Wrench sweep_contacts(std::uint32_t i, ContactBody<LinkResponse>& link) const {
    return link_contacts.sweep<pass>(i, link);
  }
  float push_out_velocity() const { return def.solver.push_out_velocity; }
  SpeedLimits limits(float h) const { return speed_limits(def.solver.max_linear_speed, h); }
};

/// Joints whose bodies are both awake, or one awake and the other an obstacle.
struct Mechanisms::Source {
  Mechanisms& m;

  std::uint32_t bodies() const { return static_cast<std::uint32_t>(m.state_.size()); }
  std::uint32_t joints() const { return static_cast<std::uint32_t>(m.graph_.joint_slots()); }
  /// Joints that only drive are left to sweeps.
  bool is_candidate(std::uint32_t slot) const {
    const Joint& j = m.graph_.joint(slot);
    if (!j.in_use || j.colour == no_colour || j.kind == ConstraintKind::coupling) return false;
    if (j.kind == ConstraintKind::ball_joint) return j.rigid;
    const GenericJoint& generic = m.graph_.generic_joint(slot);
    return j.rigid ? generic.holds() : generic.distance == 0;
  }
  bool is_soft(std::uint32_t slot) const { return !m.graph_.joint(slot).rigid; }
  std::uint32_t a(std::uint32_t slot) const { return m.graph_.joint(slot).a; }
  std::uint32_t b(std::uint32_t slot) const { return m.graph_.joint(slot).b; }
  bool is_generic(std::uint32_t slot) const { return m.graph_.joint(slot).kind == ConstraintKind::generic_joint; }
  bool is_driven(std::uint32_t slot) const { return m.graph_.is_driven(slot); }
  bool is_stiff(std::uint32_t slot) const { return is_generic(slot) && m.graph_.generic_joint(slot).is_stiff(); }
  bool is_weld(std::uint32_t slot) const { return is_generic(slot) && m.graph_.generic_joint(slot).is_weld(); }
  bool is_obstacle(std::uint32_t slot) const {
    return m.bodies_[slot].motion != MotionType::dynamic || m.state_.flags[slot] & isolated;
  }
  float inverse_mass(std::uint32_t slot) const { return m.bodies_[slot].inverse_mass; }
  bool may_collide(std::uint32_t slot) const { return fathom::may_collide(m.bodies_[slot]); }
  bool accepts(std::span<const MechanismLink> tree) const { return m.accepts(tree); }
};

MechanismSolver<Mechanisms::Access> Mechanisms::solver() {
  return {{def_, bodies_, state_, graph_, state_.solver_bodies(), states_.data(), generic_.data(), contacts_,
           pushes_.data()},
          trees_.links().data(),
          trees_.levels().data(),
          closures_.data()};
}

MechanismLanes Mechanisms::lanes(const MechanismBatch& batch, float h) {
  return {
      {trees_.mechanisms().data(), trees_.links().data(), states_.data(), generic_.data(), bodies_, state_,
       graph_.constrained(), contacts_, def_.solver.push_out_velocity, speed_limits(def_.solver.max_linear_speed, h)},
      batch};
}

template <class Act>
void Mechanisms::do_alone(const MechanismLanes& lanes, const MechanismBatch& batch, LaneBits which,
                          const Act& act) const {
  if (which == 0) return;
  for (std::uint32_t lane = 0; lane < batch.numbers.size(); ++lane)
    if (which >> lane & 1u) act(mechanism(batch.numbers[lane]));
  lanes.bring_back(which);
}

void Mechanisms::prepare(std::uint32_t number, const BlockArray& blocks, float h) {
  const MechanismBatch& batch = batches_[number];
  for (const std::uint32_t mechanism : batch.numbers) contacts_.read(mechanism, blocks, h);
  if (batch.memory) return lanes(batch).prepare();
  each(batch, [this](const Mechanism& m) { solver().prepare(m); });
}
void Mechanisms::warm_start(std::uint32_t number, float h, bool forgets) {
  const MechanismBatch& batch = batches_[number];
  const auto alone = [&](const Mechanism& m) {
    if (!solver().warm_start(m, h, forgets)) solver().pull_together(m, h);
  };
  if (!batch.memory) return each(batch, alone);
  const MechanismLanes side_by_side = lanes(batch, h);
  LaneBits others = (1u << batch.numbers.size()) - 1;
  if (forgets)
    side_by_side.take_out(others);
  else
    others = side_by_side.warm_start(h);
  do_alone(side_by_side, batch, others, alone);
}
void Mechanisms::pull_together(std::uint32_t number, float h) {
  const MechanismBatch& batch = batches_[number];
  const auto alone = [&](const Mechanism& m) { solver().pull_together(m, h); };
  if (!batch.memory) return each(batch, alone);
  const MechanismLanes side_by_side = lanes(batch, h);
  const LanesAlone left = side_by_side.pull_together(h);
  do_alone(side_by_side, batch, left.anew, alone);
  do_alone(side_by_side, batch, left.apart, [&](const Mechanism& m) { solver().come_to_rest_anew(m, h); });
}
void Mechanisms::relax(std::uint32_t number, float h) {
  const MechanismBatch& batch = batches_[number];
  if (!batch.memory) return each(batch, [&](const Mechanism& m) { solver().relax(m, h); });
  const MechanismLanes side_by_side = lanes(batch, h);
  // Obstacles have moved.
  do_alone(side_by_side, batch, side_by_side.relax(h), [&](const Mechanism& m) { solver().solve<false>(m, h); });
}
void Mechanisms::store(std::uint32_t number) {
  const MechanismBatch& batch = batches_[number];
  if (batch.memory) return lanes(batch).store();
  each(batch, [this](const Mechanism& m) { solver().store(m); });
}

void Mechanisms::note_swings(std::uint32_t number) {
  each(batches_[number], [this](const Mechanism& m) {
    const bool swings = does_swing(m);
    for (std::uint32_t i = m.first; i < m.end; ++i) state_.swings[trees_.links()[i].body] = swings;
  });
}

void Mechanisms::note_torn(std::uint32_t number) {
  const MechanismSolver<Access> direct = solver();
  each(batches_[number], [&](const Mechanism& m) {
    for (std::uint32_t i = m.first; i < m.end; ++i)
      torn_[i] =
          is_in_contact(trees_.links()[i].body) ? inertia_where_torn(direct.access, trees_.links().data(), i) : 1;
  });
}

/// If one body of a mechanism lay on something, the mechanism would settle at the velocity meant for the others between
/// positions. So would a driven one, whose drives aim at a velocity.
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

void Mechanisms::update(const ConstraintLayout& layout, bool has_moved, std::size_t threads) {
  if (!def_.solver.direct_joints) return;
  if (is_stale()) {
    is_to_find_ = false;
    colouring_ = graph_.colouring();
    joint_definitions_ = graph_.joint_definitions();
    find();
  } else if (!has_moved) {
    if (!contacts_.empty()) contacts_.choose(trees_.links());
    return;
  }
  divide(layout, threads);
}

void Mechanisms::divide(const ConstraintLayout& layout, std::size_t threads) {
  const bool any = !trees_.mechanisms().empty() || !contacts_.empty();
  if (any) contacts_.list(layout, trees_.links(), trees_.mechanisms().size());
  form_batches(layout, threads);
  if (any) contacts_.choose(trees_.links());
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
  pushes_.resize(trees_.links().size());
  torn_.assign(trees_.links().size(), 1);
  generic_.resize(trees_.generic());
  closures_.resize(trees_.closure_floats());
  find_shapes();
  find_leaning();
}

void Mechanisms::find_leaning() {
  leaning_.clear();
  for (const MechanismLink& link : trees_.links()) {
    const float inertia = link.min_inertia(bodies_[link.body].inverse_mass);
    if (inertia > 1 && is_in_contact(link.body)) leaning_.push_back({link.body, inertia});
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

bool Mechanisms::is_in_contact(std::uint32_t slot) const { return constraints_of(slot) > joints_[slot].count; }

std::uint32_t Mechanisms::constraints_of(std::uint32_t slot) const {
  return static_cast<std::uint32_t>(std::popcount(state_.colour_mask[slot])) + state_.overflow_count[slot];
}

// A coupling's row and a direct solution of what it pushes would undo each other's work: a motor and a brake on two
// wheels agree only in sweeps.
bool Mechanisms::accepts(std::span<const MechanismLink> tree) const {
  return std::ranges::none_of(tree, [this](const MechanismLink& link) { return joints_[link.body].is_coupled; });
}

// --- batches ---------------------------------------------------------------------------------------------------

/// What all lanes of a batch must have in common; empty if the mechanism cannot be solved in lanes.
std::vector<std::uint32_t> Mechanisms::shape_of(const Mechanism& m) const {
  std::vector<std::uint32_t> shape;
  if (m.closures > 0) return shape;
  for (std::uint32_t i = m.first; i < m.end; ++i) {
    const MechanismLink& link = trees_.links()[i];
    const std::uint32_t parent = link.parent != MechanismLink::none ? link.parent - m.first : MechanismLink::none;
    const std::uint32_t child = link.children > 0 ? link.first_child - m.first : MechanismLink::none;
    shape.insert(shape.end(), {parent, child, link.children, link.is_b});
    std::uint32_t kind = bodies_[link.body].isotropic;
    const auto add = [&kind](bool bit) { kind = kind << 1 | (bit ? 1u : 0u); };
    add(link.joint == MechanismLink::none), add(link.generic == MechanismLink::none);
    if (link.generic != MechanismLink::none) {
      const GenericJoint& joint = graph_.generic_joint(link.joint);
      add(joint.distance != 0), add(joint.cone != 0), add(joint.moves != 0), add(joint.reacts != 0);
      for (const GenericAxis<float>& axis : joint.axes) {
        add(axis.locked != 0), add(axis.limited != 0), add(axis.most > 0), add(axis.armature > 0);
      }
    }
    shape.push_back(kind);
  }
  return shape;
}

void Mechanisms::find_shapes() {
  shapes_.assign(trees_.mechanisms().size(), no_shape);
  if (shapes_.size() < min_lanes) return;
  std::map<std::vector<std::uint32_t>, std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < shapes_.size(); ++i) {
    std::vector<std::uint32_t> shape = shape_of(mechanism(i));
    if (!shape.empty()) shapes_[i] = numbers.try_emplace(std::move(shape), i).first->second;
  }
}

void Mechanisms::form_batches(const ConstraintLayout& layout, std::size_t threads) {
  first_of_group_.clear();
  batches_.clear();
  batch_numbers_.clear();
  if (empty()) return;
  const std::size_t count = order_.size(), groups = layout.groups().size();
  group_of_.assign(state_.size(), 0);
  for (std::uint32_t g = 0; g < groups; ++g)
    for (const std::uint32_t slot : layout.bodies(layout.groups()[g])) group_of_[slot] = g;
  const auto group = [&](std::uint32_t number) { return group_of_[trees_.links()[mechanism(number).first].body]; };
  const auto key = [&](std::uint32_t number) {
    return std::tuple(group(number), shape_in_lanes(number), contacts_.cluster(number).first, number);
  };
  std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  // A batch takes as long as two or three mechanisms solved alone, however many of its lanes are in use.
  const bool shares = groups > 0 || count > (min_lanes - 1) * threads;
  const std::size_t size = shares ? mechanism_lanes : 1;
  std::size_t next = 0;
  for (std::uint32_t g = 0; g < std::max<std::size_t>(groups, 1); ++g) {
    first_of_group_.push_back(static_cast<std::uint32_t>(batches_.size()));
    while (next < count && group(order_[next]) == g) {
      std::size_t end = next + 1;
      const LinkContacts::Cluster cluster = contacts_.cluster(order_[next]);
      if (cluster.size > 1) {
        end = next + cluster.size;
      } else {
        const auto belongs = [&](std::uint32_t number) {
          return shape_in_lanes(number) == shape_in_lanes(order_[next]) && contacts_.cluster(number).size == 1 &&
                 group(number) == g;
        };
        while (end < count && end - next < size && belongs(order_[end])) ++end;
      }
      batches_.push_back({std::span(order_).subspan(next, end - next), nullptr});
      next = end;
    }
  }
  first_of_group_.push_back(static_cast<std::uint32_t>(batches_.size()));
  batch_numbers_.resize(batches_.size());
  for (std::uint32_t i = 0; i < batch_numbers_.size(); ++i) batch_numbers_[i] = i;
  give_memory();
}

void Mechanisms::give_memory() {
  const auto lines_of = [this](const MechanismBatch& batch) -> std::size_t {
    const Mechanism& m = mechanism(batch.numbers[0]);
    if (batch.numbers.size() < min_lanes || shape_in_lanes(batch.numbers[0]) == no_shape) return 0;
    std::uint32_t generic = 0;
    for (std::uint32_t i = m.first; i < m.end; ++i) generic += trees_.links()[i].generic != MechanismLink::none;
    return (batch_bytes(m.end - m.first, generic) + sizeof(Line) - 1) / sizeof(Line);
  };
  std::size_t lines = 0;
  for (const MechanismBatch& batch : batches_) lines += lines_of(batch);
  if (batch_memory_.size() < lines) batch_memory_.resize(lines);
  Line* next = batch_memory_.data();
  for (MechanismBatch& batch : batches_)
    if (const std::size_t own = lines_of(batch)) batch.memory = next, next += own;
}

std::size_t Mechanisms::memory_bytes() const {
  if (states_.capacity() == 0 && joints_.capacity() == 0) return trees_.memory_bytes();  // steps ask for it
  const auto bytes_of = [](const auto&... array) { return (... + (array.capacity() * sizeof(*array.data()))); };
  return trees_.memory_bytes() + contacts_.memory_bytes() +
         bytes_of(states_, pushes_, generic_, closures_, joints_, leaning_, torn_, batches_, batch_memory_, order_,
                  first_of_group_, batch_numbers_, shapes_, group_of_);
}

}  // namespace fathom::native
