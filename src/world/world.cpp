// The World: checks the application's arguments, then forwards to its simulator.
#include <algorithm>
#include <fathom/world.hpp>
#include <new>
#include <string>
#include <tuple>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "check/check.hpp"
#include "dynamics/generic_joint.hpp"
#include "dynamics/integrate.hpp"
#include "math/eigen.hpp"
#include "world/placement.hpp"
#include "world/simulator.hpp"
#include "world/validate.hpp"

namespace fathom {

namespace {

WorldDef normalised(WorldDef def) {
  check_world(def);
  def.sweep_axis = normalize(def.sweep_axis);
  return def;
}

/// The slot of a body, for actions forbidden in callbacks.
std::uint32_t slot_to_change(const Simulator& simulator, BodyId id, const char* action) {
  simulator.callbacks.check_not_called(action);
  return simulator.bodies.slot(id, action);
}
std::uint32_t slot_to_change(const Simulator& simulator, JointId id, const char* action) {
  simulator.callbacks.check_not_called(action);
  return simulator.joints.slot(id, action);
}

/// The slot of a dynamic body.
std::uint32_t dynamic_slot(const Simulator& simulator, BodyId id, const char* action) {
  const std::uint32_t slot = slot_to_change(simulator, id, action);
  check_dynamic(simulator.bodies[slot].motion, action);
  return slot;
}

}  // namespace

std::unique_ptr<Simulator> make_simulator(const WorldDef& def) {
  switch (def.simulator) {
    case SimulatorKind::device:
      return make_device_simulator(def);
    case SimulatorKind::hybrid:
      return make_hybrid_simulator(def);
    default:
      return make_native_simulator(def);
  }
}

World::World(const WorldDef& def) : simulator_(make_simulator(normalised(def))) {}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

const WorldDef& World::definition() const { return simulator_->def; }
std::string World::hardware() const { return simulator_->hardware(); }

// Bodies --------------------------------------------------------------------------------------------------

namespace {

/// Reports once that velocities are limited.
void tell_of_limits(Simulator& sim, std::uint32_t slot, Vec3 linear, Vec3 angular) {
  if (!sim.def.log || sim.told_of_limits) return;
  const SpeedLimits limits =
      speed_limits(sim.def.solver.max_linear_speed, sim.def.dt / static_cast<float>(sim.def.solver.substeps));
  const bool is_linear = !(limited(linear, limits.linear) == linear);
  if (!is_linear && limited(angular, limits.angular) == angular) return;
  sim.told_of_limits = true;
  const std::string limit = is_linear ? std::to_string(limits.linear) + " m/s; raise SolverSettings::max_linear_speed"
                                      : std::to_string(limits.angular) + " rad/s; take shorter or more substeps";
  sim.def.log("body " + std::to_string(slot) + " is given a velocity beyond the limit, and slowed to " + limit);
}

}  // namespace

BodyId World::add(const BodyDef& def) {
  Simulator& sim = *simulator_;
  sim.callbacks.check_not_called("add body");
  check_body(def);
  if (sim.bodies.count() >= sim.def.max_bodies)
    throw Error(ErrorCode::capacity, "add body: the world already holds its limit of " +
                                         std::to_string(sim.def.max_bodies) + " bodies; raise WorldDef::max_bodies");
  const BodyId id = sim.bodies.add(def);
  const Pose pose{def.pose.position, 0, normalize(def.pose.rotation)};
  const Velocity velocity =
      def.motion == MotionType::fixed ? Velocity{} : Velocity{def.velocity.linear, 0, def.velocity.angular, 0};
  tell_of_limits(sim, id.index, velocity.linear, velocity.angular);
  try {
    sim.body_added(id.index, pose, velocity);
  } catch (const std::bad_alloc&) {
    sim.bodies.remove(id);
    throw Error(ErrorCode::capacity, "add body: out of memory at " + std::to_string(sim.bodies.count()) + " bodies");
  }
  return id;
}

std::vector<BodyId> World::add_bodies(std::span<const BodyDef> defs) {
  const auto refused = [](std::size_t i, const Error& error) {
    return Error(error.code(), "body " + std::to_string(i) + ": " + error.what());
  };
  for (std::size_t i = 0; i < defs.size(); ++i) try {
      check_body(defs[i]);
    } catch (const Error& error) {
      throw refused(i, error);
    }
  const std::vector<std::uint32_t> order = placement_order(defs);
  std::vector<BodyId> ids(defs.size());
  for (std::size_t added = 0; added < order.size(); ++added) try {
      ids[order[added]] = add(defs[order[added]]);
    } catch (const Error& error) {
      const Error of_body = refused(order[added], error);
      while (added > 0) remove(ids[order[--added]]);
      throw of_body;
    }
  return ids;
}

void World::reserve(std::uint32_t count) {
  simulator_->callbacks.check_not_called("reserve");
  const std::uint32_t limit = simulator_->def.max_bodies;
  if (count > limit)
    throw Error(ErrorCode::capacity, "reserve: " + std::to_string(count) +
                                         " bodies are more than the world's limit of " + std::to_string(limit) +
                                         "; raise WorldDef::max_bodies");
  try {
    simulator_->bodies.reserve(count);
    simulator_->reserve(count);
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::capacity, "reserve: out of memory for " + std::to_string(count) + " bodies");
  }
}

void World::optimize_broad_phase() {
  simulator_->callbacks.check_not_called("optimize_broad_phase");
  try {
    simulator_->optimize_broad_phase();
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::capacity, "optimize_broad_phase: out of memory");
  }
}

void World::remove(BodyId id) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "remove body");
  while (!simulator_->joints.of(slot).empty()) remove_joint(simulator_->joints.id(simulator_->joints.of(slot).back()));
  while (!simulator_->excluded.of(slot).empty())
    include(id, simulator_->bodies.id(simulator_->excluded.of(slot).back()));
  simulator_->body_removed(slot);
  simulator_->bodies.remove(id);
}

bool World::contains(BodyId id) const { return simulator_->bodies.contains(id); }
std::uint32_t World::body_count() const { return simulator_->bodies.count(); }
std::span<const BodyId> World::bodies() const { return simulator_->bodies.living(); }
std::span<const Pose> World::poses() const { return simulator_->poses(); }
std::optional<DevicePoses> World::device_poses() const { return simulator_->device_poses(); }
std::span<const Velocity> World::velocities() const { return simulator_->velocities(); }

const Pose& World::pose(BodyId id) const { return simulator_->poses()[simulator_->bodies.slot(id, "read pose")]; }

void World::set_pose(BodyId id, const Pose& pose) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "set pose");
  check_pose(pose, "set pose");
  simulator_->set_pose(slot, {pose.position, 0, normalize(pose.rotation)});
}

const Velocity& World::velocity(BodyId id) const {
  return simulator_->velocities()[simulator_->bodies.slot(id, "read velocity")];
}

void World::set_velocity(BodyId id, Vec3 linear, Vec3 angular) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "set velocity");
  check_finite(linear, "set velocity", "the linear velocity");
  check_finite(angular, "set velocity", "the angular velocity");
  if (simulator_->bodies[slot].motion == MotionType::fixed)
    refuse("set velocity: the body is fixed; make it kinematic to move it by its velocity");
  tell_of_limits(*simulator_, slot, linear, angular);
  simulator_->set_velocity(slot, {linear, 0, angular, 0});
}

void World::add_velocity(BodyId id, Vec3 linear, Vec3 angular) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "add velocity");
  check_finite(linear, "add velocity", "the change of linear velocity");
  check_finite(angular, "add velocity", "the change of angular velocity");
  if (simulator_->bodies[slot].motion == MotionType::fixed)
    refuse("add velocity: the body is fixed; make it kinematic to move it by its velocity");
  simulator_->add_velocity(slot, {linear, 0, angular, 0});
}

void World::move_to(BodyId id, const Pose& pose) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "move to");
  check_pose(pose, "move to");
  const MotionType motion = simulator_->bodies[slot].motion;
  if (motion != MotionType::kinematic)
    refuse(std::string("move to: the body is ") + (motion == MotionType::fixed ? "fixed" : "dynamic") +
           "; only kinematic bodies can be moved along");
  simulator_->move_to(slot, {pose.position + Vec3{}, 0, normalize(pose.rotation)});
}

MotionType World::motion(BodyId id) const {
  return simulator_->bodies[simulator_->bodies.slot(id, "read motion")].motion;
}
Shape World::shape(BodyId id) const { return simulator_->bodies[simulator_->bodies.slot(id, "read shape")].shape(); }
float World::mass(BodyId id) const { return simulator_->bodies[simulator_->bodies.slot(id, "read mass")].mass; }

MassProperties World::mass_properties(BodyId id) const {
  const BodyInfo& info = simulator_->bodies[simulator_->bodies.slot(id, "read mass properties")];
  if (info.motion != MotionType::dynamic) return {};
  const PrincipalFrame frame = principal_frame(info.inertia);
  return {info.mass, info.inertia, frame.moments, frame.rotation};
}

Aabb World::bounds(BodyId id) const { return simulator_->bounds(simulator_->bodies.slot(id, "read bounds")); }

std::uint64_t World::user_data(BodyId id) const {
  return simulator_->bodies.user_data(simulator_->bodies.slot(id, "read user data"));
}

void World::set_user_data(BodyId id, std::uint64_t data) {
  simulator_->bodies.set_user_data(slot_to_change(*simulator_, id, "set user data"), data);
}

void World::set_material(BodyId id, const Material& material) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "set material");
  check_material(material, "set material");
  simulator_->bodies[slot].material = material;
  simulator_->material_changed(slot);
}

const Material& World::material(BodyId id) const {
  return simulator_->bodies[simulator_->bodies.slot(id, "read material")].material;
}

void World::set_filter(BodyId id, Filter filter) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "set filter");
  Filter& now = simulator_->bodies[slot].filter;
  if (now.category == filter.category && now.mask == filter.mask && now.group == filter.group) return;
  now = filter;
  simulator_->filter_changed(slot);
}

Filter World::filter(BodyId id) const { return simulator_->bodies[simulator_->bodies.slot(id, "read filter")].filter; }

void World::exclude(BodyId a, BodyId b) {
  const std::uint32_t slot_a = slot_to_change(*simulator_, a, "exclude");
  const std::uint32_t slot_b = slot_to_change(*simulator_, b, "exclude");
  if (a == b) refuse("exclude: both bodies are the same one; exclude two different bodies from each other");
  if (simulator_->excluded.add(slot_a, slot_b)) simulator_->pair_excluded(slot_a, slot_b);
}

void World::include(BodyId a, BodyId b) {
  const std::uint32_t slot_a = slot_to_change(*simulator_, a, "include");
  const std::uint32_t slot_b = slot_to_change(*simulator_, b, "include");
  if (simulator_->excluded.remove(slot_a, slot_b)) simulator_->pair_included(slot_a, slot_b);
}

bool World::is_excluded(BodyId a, BodyId b) const {
  const char* const action = "read whether bodies are excluded";
  return simulator_->excluded.contains(simulator_->bodies.slot(a, action), simulator_->bodies.slot(b, action));
}

/// Throws what adding the body would, and names the action.
static void check_change(const BodyDef& def, const char* action) {
  try {
    check_body(def);
    BodyTable().add(def);  // throws what the table would, before anything changes
  } catch (const Error& error) {
    constexpr std::string_view adding = "add body";
    std::string text = error.what();
    if (text.starts_with(adding)) text.replace(0, adding.size(), action);
    throw Error(error.code(), text);
  }
}

/// Redefines the body in place, with its joints.
static void change_body(Simulator& sim, std::uint32_t slot, const BodyDef& def, const char* action) {
  check_change(def, action);
  sim.synchronise();
  const Pose pose = sim.poses()[slot];
  const Velocity velocity = def.motion == MotionType::fixed ? Velocity{} : sim.velocities()[slot];
  const std::vector<std::uint32_t> joints(sim.joints.of(slot).begin(), sim.joints.of(slot).end());
  for (const std::uint32_t joint : joints) sim.joint_removed(joint);
  for (const std::uint32_t other : sim.excluded.of(slot)) sim.pair_included(slot, other);
  sim.body_removed(slot);
  sim.bodies.change(slot, def);
  sim.body_added(slot, pose, velocity);
  for (const std::uint32_t other : sim.excluded.of(slot)) sim.pair_excluded(slot, other);
  for (const std::uint32_t joint : joints) {
    sim.joints.change(joint, JointDef(sim.joints[joint].def), sim.bodies);
    sim.joint_added(joint);
  }
}

void World::set_motion(BodyId id, MotionType motion) {
  Simulator& sim = *simulator_;
  const std::uint32_t slot = slot_to_change(sim, id, "set motion");
  BodyDef def = sim.bodies.definition(slot);
  if (def.motion == motion) return;
  if (def.motion == MotionType::dynamic)
    for (const std::uint32_t joint : sim.joints.of(slot)) {
      const JointDef& of = sim.joints[joint].def;
      if (sim.bodies[of.a == id ? of.b.index : of.a.index].motion != MotionType::dynamic)
        refuse("set motion: a joint holds this body to one that is not dynamic either; remove the joint first");
    }
  def.motion = motion;
  if (motion != MotionType::dynamic) def.mass.reset(), def.inertia.reset();
  change_body(sim, slot, def, "set motion");
}

void World::set_shape(BodyId id, const Shape& shape) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "set shape");
  BodyDef def = simulator_->bodies.definition(slot);
  def.shape = shape;
  def.inertia.reset();
  change_body(*simulator_, slot, def, "set shape");
}

void World::set_mass(BodyId id, float mass, const std::optional<SymMat3>& inertia) {
  Simulator& sim = *simulator_;
  const std::uint32_t slot = slot_to_change(sim, id, "set mass");
  BodyDef def = sim.bodies.definition(slot);
  if (def.motion != MotionType::dynamic) refuse("set mass: the body is not dynamic; only dynamic bodies have a mass");
  const float mass_before = *def.mass;
  const SymMat3 inertia_before = *def.inertia;
  def.mass = mass;
  def.inertia = inertia;
  check_change(def, "set mass");
  sim.bodies.change(slot, def);
  if (sim.bodies[slot].mass == mass_before && sim.bodies[slot].inertia == inertia_before) return;
  sim.mass_changed(slot);
  for (const std::uint32_t joint : sim.joints.of(slot)) {
    sim.joints.change(joint, JointDef(sim.joints[joint].def), sim.bodies);
    sim.joint_changed(joint);
  }
}

void World::set_sensor(BodyId id, bool sensor) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "set sensor");
  BodyDef def = simulator_->bodies.definition(slot);
  if (def.sensor == sensor) return;
  def.sensor = sensor;
  change_body(*simulator_, slot, def, "set sensor");
}

bool World::is_sensor(BodyId id) const {
  return simulator_->bodies[simulator_->bodies.slot(id, "read whether it is a sensor")].is_sensor;
}

void World::set_pre_solve(BodyId id, bool pre_solve) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "set pre_solve");
  simulator_->bodies.set_pre_solve(slot, pre_solve);
  simulator_->material_changed(slot);  // mixes materials again in contacts that the callback changed
}

bool World::has_pre_solve(BodyId id) const {
  return simulator_->bodies[simulator_->bodies.slot(id, "read pre_solve")].pre_solve;
}

void World::set_custom_filter(BodyId id, bool custom_filter) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "set custom_filter");
  simulator_->bodies.set_custom_filter(slot, custom_filter);
  simulator_->filter_changed(slot);
}

bool World::has_custom_filter(BodyId id) const {
  return simulator_->bodies[simulator_->bodies.slot(id, "read custom_filter")].custom_filter;
}

void World::set_bullet(BodyId id, bool bullet) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "set bullet");
  simulator_->bodies[slot].is_bullet = bullet;
  simulator_->info_changed(slot);
}

bool World::is_bullet(BodyId id) const {
  return simulator_->bodies[simulator_->bodies.slot(id, "read whether it is a bullet")].is_bullet;
}

void World::set_gravity_scale(BodyId id, float scale) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "set gravity scale");
  check_finite({scale, 0, 0}, "set gravity scale", "the scale");
  simulator_->bodies[slot].gravity_scale = scale;
  simulator_->info_changed(slot);
}

void World::set_damping(BodyId id, float linear, float angular) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "set damping");
  check_damping(linear, angular, "set damping");
  simulator_->bodies[slot].linear_damping = linear;
  simulator_->bodies[slot].angular_damping = angular;
  simulator_->info_changed(slot);
}

bool World::is_awake(BodyId id) const { return simulator_->is_awake(simulator_->bodies.slot(id, "read sleep state")); }
void World::wake(BodyId id) { simulator_->wake(slot_to_change(*simulator_, id, "wake")); }

// Joints ----------------------------------------------------------------------------------------------------

static void apply_change(Simulator& sim, std::uint32_t slot, const JointDef& def) {
  sim.joints.change(slot, def, sim.bodies);
  sim.joint_changed(slot);
}

JointId World::add_joint(const JointDef& def) {
  Simulator& sim = *simulator_;
  sim.callbacks.check_not_called("add joint");
  check_joint(def);
  if (sim.def.partition == Partition::cells)
    refuse("add joint: the partition `cells` is for contacts alone; create the world with Partition::colours");
  const std::uint32_t a = sim.bodies.slot(def.a, "add joint"), b = sim.bodies.slot(def.b, "add joint");
  if (sim.bodies[a].motion != MotionType::dynamic && sim.bodies[b].motion != MotionType::dynamic)
    refuse("add joint: neither body is dynamic; a joint can move dynamic bodies alone");
  const JointId id = sim.joints.add(def, sim.bodies);
  try {
    sim.joint_added(id.index);
  } catch (const std::bad_alloc&) {
    sim.joints.remove(id.index);
    throw Error(ErrorCode::capacity, "add joint: out of memory at " + std::to_string(sim.joints.count()) + " joints");
  }
  return id;
}

void World::remove_joint(JointId id) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "remove joint");
  simulator_->joint_removed(slot);
  simulator_->joints.remove(slot);
}

bool World::contains(JointId id) const { return simulator_->joints.contains(id); }
std::uint32_t World::joint_count() const { return simulator_->joints.count(); }
std::span<const JointId> World::joints() const { return simulator_->joints.living(); }

const JointDef& World::joint(JointId id) const {
  return simulator_->joints[simulator_->joints.slot(id, "read joint")].def;
}

void World::set_joint_spring(JointId id, float hertz, float damping_ratio) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "set joint spring");
  check_joint_spring(hertz, damping_ratio, "set joint spring");
  JointDef def = simulator_->joints[slot].def;
  def.hertz = hertz, def.damping_ratio = damping_ratio;
  check_joint_force(def, "set joint spring");
  apply_change(*simulator_, slot, def);
}

void World::set_joint_axis(JointId id, JointAxisName name, const JointAxis& axis) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "set joint axis");
  JointDef def = simulator_->joints[slot].def;
  if (def.type == JointType::ball) refuse("set joint axis: a ball joint has none; create a generic one");
  check_joint_axis(def, name, axis, "set joint axis");
  def.axis(name) = axis;
  check_joint(def, "set joint axis");
  apply_change(*simulator_, slot, def);
}

void World::set_joint_frames(JointId id, const Pose& frame_a, const Pose& frame_b) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "set joint frames");
  JointDef def = simulator_->joints[slot].def;
  def.frame_a = frame_a, def.frame_b = frame_b;
  check_joint(def, "set joint frames");
  apply_change(*simulator_, slot, def);
}

void World::set_joint_target(JointId id, Vec3 target) {
  const char* const action = "set joint target";
  Simulator& sim = *simulator_;
  const std::uint32_t slot = slot_to_change(sim, id, action);
  check_finite(target, action, "the target");
  JointDef def = sim.joints[slot].def;
  const std::uint32_t a = sim.bodies.slot(def.a, action), b = sim.bodies.slot(def.b, action);
  const bool a_moves = sim.bodies[a].motion == MotionType::dynamic;
  if (a_moves && sim.bodies[b].motion == MotionType::dynamic)
    refuse("set joint target: both bodies are dynamic; a target is where a joint holds on to a fixed or kinematic one");
  Vec3& anchor = (a_moves ? def.frame_b : def.frame_a).position;
  const Vec3 there = inverse_transform(pose(a_moves ? def.b : def.a), target);
  if (there == anchor) return;
  anchor = there;
  check_joint(def, action);
  apply_change(sim, slot, def);
}

void World::set_joint_break(JointId id, float force, float torque) {
  const std::uint32_t slot = slot_to_change(*simulator_, id, "set joint break");
  check_joint_break(force, torque, "set joint break");
  JointDef def = simulator_->joints[slot].def;
  def.break_force = force, def.break_torque = torque;
  apply_change(*simulator_, slot, def);
}

void World::change_joint(JointId id, const JointDef& definition) {
  const char* const action = "change joint";
  const std::uint32_t slot = slot_to_change(*simulator_, id, action);
  const JointDef& last = simulator_->joints[slot].def;
  if (definition.type != last.type || definition.collide_connected != last.collide_connected)
    refuse("change joint: its type and `collide_connected` stay as they are; remove it and add another");
  JointDef next = definition;
  next.a = last.a, next.b = last.b;
  check_joint(next, action);
  apply_change(*simulator_, slot, next);
}

JointId World::find_joint(BodyId a, BodyId b, std::uint64_t user_data) const {
  const JointTable& joints = simulator_->joints;
  const std::uint32_t body = simulator_->bodies.slot(a, "find joint");
  simulator_->bodies.slot(b, "find joint");
  for (const std::uint32_t slot : joints.of(body)) {
    const JointDef& def = joints[slot].def;
    if (def.a == a && def.b == b && def.user_data == user_data) return joints.id(slot);
  }
  throw Error(ErrorCode::stale_id, "find joint: no joint from body " + std::to_string(a.index) + " to body " +
                                       std::to_string(b.index) + " has the user data " + std::to_string(user_data) +
                                       "; it went with a body, broke, or was never added");
}

JointReaction World::reaction(JointId id) const {
  const std::uint32_t slot = simulator_->joints.slot(id, "read reaction");
  simulator_->synchronise();
  return simulator_->reaction(slot);
}

JointPositions World::joint_positions(JointId id) const {
  const JointInfo& info = simulator_->joints[simulator_->joints.slot(id, "read joint positions")];
  simulator_->synchronise();
  return joint_axis_positions(info.def, simulator_->poses()[info.def.a.index], simulator_->poses()[info.def.b.index],
                              info.swapped);
}

// Callbacks --------------------------------------------------------------------------------------------------

void World::set_pre_solve_callback(std::function<void(PreSolveContact&)> callback) {
  Simulator& sim = *simulator_;
  sim.callbacks.check_not_called("set pre-solve callback");
  sim.callbacks.pre_solve = std::move(callback);
  sim.callbacks_changed();
  if (sim.callbacks.pre_solve) return;
  for (const std::uint32_t slot : sim.bodies.pre_solvers()) sim.material_changed(slot);
}

void World::set_filter_callback(std::function<bool(BodyId, BodyId)> callback) {
  simulator_->callbacks.check_not_called("set filter callback");
  simulator_->callbacks.filter = std::move(callback);
  simulator_->callbacks_changed();
}

// Forces and impulses ---------------------------------------------------------------------------------------

void World::apply_force(BodyId id, Vec3 force) {
  const std::uint32_t slot = dynamic_slot(*simulator_, id, "apply force");
  check_finite(force, "apply force", "the force");
  simulator_->apply(slot, force, {});
}

void World::apply_force_at(BodyId id, Vec3 force, Vec3 point) {
  const std::uint32_t slot = dynamic_slot(*simulator_, id, "apply force");
  check_finite(force, "apply force", "the force");
  check_finite(point, "apply force", "the point");
  const Vec3 torque = cross(point - simulator_->poses()[slot].position, force);
  check_finite(torque, "apply force", "the torque of the force at this point");
  simulator_->apply(slot, force, torque);
}

void World::apply_torque(BodyId id, Vec3 torque) {
  const std::uint32_t slot = dynamic_slot(*simulator_, id, "apply torque");
  check_finite(torque, "apply torque", "the torque");
  simulator_->apply(slot, {}, torque);
}

void World::apply_impulse(BodyId id, Vec3 impulse) {
  const std::uint32_t slot = dynamic_slot(*simulator_, id, "apply impulse");
  check_finite(impulse, "apply impulse", "the impulse");
  simulator_->add_impulse(slot, {impulse, 0, {}, 0});
}

void World::apply_impulse_at(BodyId id, Vec3 impulse, Vec3 point) {
  const std::uint32_t slot = dynamic_slot(*simulator_, id, "apply impulse");
  check_finite(impulse, "apply impulse", "the impulse");
  check_finite(point, "apply impulse", "the point");
  const Vec3 turn = cross(point - simulator_->poses()[slot].position, impulse);
  check_finite(turn, "apply impulse", "the angular impulse of the impulse at this point");
  simulator_->add_impulse(slot, {impulse, 0, turn, 0});
}

void World::apply_angular_impulse(BodyId id, Vec3 impulse) {
  const std::uint32_t slot = dynamic_slot(*simulator_, id, "apply angular impulse");
  check_finite(impulse, "apply angular impulse", "the impulse");
  simulator_->add_impulse(slot, {{}, 0, impulse, 0});
}

// Time and results --------------------------------------------------------------------------------------------

void World::step() {
  if constexpr (check::asserts) check::current_step = simulator_->steps + 1;
  simulator_->callbacks.check_not_called("step");
  simulator_->sensors.begin_step(*simulator_);
  simulator_->step();
  simulator_->sensors.end_step(*simulator_);
  simulator_->break_joints();
  for (const Quarantine& q : simulator_->quarantined())
    if (simulator_->def.log)
      simulator_->def.log("step " + std::to_string(q.step) + ": the state of body {index " +
                          std::to_string(q.body.index) + ", generation " + std::to_string(q.body.generation) +
                          "} was not finite; it stays where it was until its pose or velocity is set");
  simulator_->callbacks.rethrow();
}

void World::wait() const { simulator_->synchronise(); }

std::uint64_t World::step_count() const { return simulator_->steps; }
double World::time() const { return static_cast<double>(simulator_->steps) * static_cast<double>(simulator_->def.dt); }

void World::shift_origin(Vec3 new_origin) {
  const char* const action = "shift the origin";
  simulator_->callbacks.check_not_called(action);
  check_finite(new_origin, action, "the new origin");
  std::vector<Pose> poses(simulator_->poses().begin(), simulator_->poses().end());
  for (const BodyId id : bodies()) {
    poses[id.index].position = poses[id.index].position - new_origin;
    check_pose(poses[id.index], action);
  }
  std::vector<std::pair<std::uint32_t, JointDef>> couplings;
  for (const JointId id : joints()) {
    JointDef def = joint(id);
    if (def.type != JointType::coupling) continue;
    for (CouplingEnd* const end : {&def.coupled_a, &def.coupled_b})
      end->from.position = end->from.position - new_origin;
    check_joint(def, action);
    couplings.emplace_back(id.index, def);
  }
  for (const BodyId id : bodies()) simulator_->set_pose(id.index, poses[id.index]);
  for (const auto& [slot, def] : couplings) apply_change(*simulator_, slot, def);
}

void World::set_gravity(Vec3 gravity) {
  simulator_->callbacks.check_not_called("set gravity");
  check_finite(gravity, "set gravity", "the gravity");
  if (gravity == simulator_->def.gravity) return;
  simulator_->def.gravity = gravity;
  simulator_->gravity_changed();
}

Vec3 World::gravity() const { return simulator_->def.gravity; }
const Profile& World::profile() const { return simulator_->current_profile(); }
std::span<const ContactEvent> World::contacts_begun() const { return simulator_->contacts_begun(); }
std::span<const ContactEvent> World::contacts_ended() const { return simulator_->contacts_ended(); }
std::span<const HitEvent> World::hits() const { return simulator_->hits(); }
std::span<const JointBreak> World::joints_broken() const { return simulator_->broken.read(); }
std::span<const Quarantine> World::quarantined() const { return simulator_->quarantined(); }

std::span<const SensorEvent> World::sensor_begun() const { return simulator_->sensors.begun.read(); }
std::span<const SensorEvent> World::sensor_ended() const { return simulator_->sensors.ended.read(); }

void World::for_each_in_sensor(BodyId sensor, const std::function<void(BodyId)>& visit) const {
  const char* const action = "read who is in a sensor";
  if (!simulator_->bodies[simulator_->bodies.slot(sensor, action)].is_sensor)
    refuse(std::string(action) + ": the body is no sensor; make it one with BodyDef::sensor or set_sensor");
  std::vector<BodyId> inside;
  for (const Presence& p : simulator_->sensors.inside(sensor))
    if (simulator_->bodies.contains(p.body)) inside.push_back(p.body);
  for (const BodyId id : inside) visit(id);
}

void World::for_each_contact(const std::function<void(const ContactInfo&)>& visit) const {
  simulator_->for_each_contact(visit);
}

void World::for_each_contact_of(BodyId id, const std::function<void(const ContactInfo&)>& visit) const {
  const std::uint32_t slot = simulator_->bodies.slot(id, "read contacts");
  std::vector<ContactInfo> contacts;
  simulator_->for_each_contact_of(slot, [&](const ContactInfo& contact) { contacts.push_back(contact); });
  std::ranges::sort(contacts, [&](const ContactInfo& x, const ContactInfo& y) {
    const auto key = [&](const ContactInfo& c) {
      return std::tuple(c.a.index == slot ? c.b.index : c.a.index, c.child_a, c.child_b);
    };
    return key(x) < key(y);
  });
  for (const ContactInfo& contact : contacts) visit(contact);
}

std::uint64_t World::state_hash() const {
  simulator_->synchronise();
  XXH3_state_t* state = XXH3_createState();
  XXH3_64bits_reset(state);
  for (const BodyId id : bodies()) {
    XXH3_64bits_update(state, &simulator_->poses()[id.index], sizeof(Pose));
    XXH3_64bits_update(state, &simulator_->velocities()[id.index], sizeof(Velocity));
  }
  const std::uint64_t hash = XXH3_64bits_digest(state);
  XXH3_freeState(state);
  return hash;
}

}  // namespace fathom
