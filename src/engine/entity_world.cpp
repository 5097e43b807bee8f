#include "engine/entity_world.hpp"

#include <algorithm>
#include <utility>

#include "engine/engine.hpp"

namespace fathom::engine {
namespace {

constexpr std::uint32_t nowhere = 0xffffffffu;

/// An entity whose logic is a function.
class FunctionEntity final : public Entity {
 public:
  explicit FunctionEntity(TickFunction tick) : tick_(std::move(tick)) {}
  void tick(const Tick& tick) override { tick_(*this, tick); }

 private:
  TickFunction tick_;
};

/// The pose `share` of the way between two; rotations by normalised linear interpolation (nlerp), the shorter way.
Pose between(const Pose& from, const Pose& to, float share) {
  const Quat &a = from.rotation, &b = to.rotation;
  const float sign = dot(a, b) < 0 ? -share : share;
  const float rest = 1 - share;
  return {mul_add(from.position, share, to.position - from.position), 0,
          normalize(Quat{rest * a.w + sign * b.w, rest * a.x + sign * b.x, rest * a.y + sign * b.y,
                         rest * a.z + sign * b.z})};
}

}  // namespace

EntityWorld::~EntityWorld() = default;

// --- coming and going ------------------------------------------------------------------------------------------

EntityId EntityWorld::spawn(EntityDef def, std::unique_ptr<Entity> entity) {
  std::uint32_t index;
  if (free_.empty()) {
    index = static_cast<std::uint32_t>(slots_.size());
    slots_.emplace_back();
  } else {
    index = free_.back();
    free_.pop_back();
  }
  Slot& slot = slots_[index];
  slot.entity = entity ? std::move(entity) : std::make_unique<Entity>();
  slot.generation += 1;
  slot.alive = slot.doomed = false;
  const EntityId id{index, slot.generation};
  waiting_.push_back({id, std::move(def)});
  return id;
}

EntityId EntityWorld::spawn(EntityDef def, TickFunction tick) {
  return spawn(std::move(def), std::make_unique<FunctionEntity>(std::move(tick)));
}

bool EntityWorld::destroy(EntityId id) {
  if (id.index >= slots_.size() || slots_[id.index].generation != id.generation || !slots_[id.index].entity)
    return false;
  Slot& slot = slots_[id.index];
  if (!slot.doomed && slot.alive) doomed_.push_back(id.index);
  slot.doomed = true;
  return true;
}

void EntityWorld::join(EntityId a, EntityId b, const JointDef& definition) {
  order_joint(CommandKind::join, a, b, definition);
}

void EntityWorld::change_joint(EntityId a, EntityId b, const JointDef& definition) {
  order_joint(CommandKind::change_joint, a, b, definition);
}

void EntityWorld::unjoin(EntityId a, EntityId b, std::uint64_t user_data) {
  JointDef named;
  named.user_data = user_data;
  order_joint(CommandKind::unjoin, a, b, named);
}

void EntityWorld::exclude(EntityId a, EntityId b) { order_joint(CommandKind::exclude, a, b, {}); }
void EntityWorld::include(EntityId a, EntityId b) { order_joint(CommandKind::include, a, b, {}); }

void EntityWorld::order_joint(CommandKind kind, EntityId a, EntityId b, const JointDef& definition) {
  const auto body = [this](EntityId id) {
    const Entity* const entity = find(id);
    if (entity && entity->has_physics()) return entity->body();
    throw Error(ErrorCode::stale_id, "joint: entity " + std::to_string(id.index) +
                                         " has no body in the simulation; join entities that live and are simulated");
  };
  const BodyHandle first = body(a), second = body(b);
  commands_.joint(kind, first, second, definition);
}

Entity* EntityWorld::find(EntityId id) {
  if (id.index >= slots_.size()) return nullptr;
  const Slot& slot = slots_[id.index];
  return slot.alive && slot.generation == id.generation ? slot.entity.get() : nullptr;
}

Entity* EntityWorld::find(std::string_view name) {
  const auto found =
      std::find_if(slots_.begin(), slots_.end(), [&](const Slot& s) { return s.alive && s.entity->name_ == name; });
  return found == slots_.end() ? nullptr : found->entity.get();
}

std::uint32_t EntityWorld::take_over_changes(std::uint32_t limit, Failures& failures) {
  // Requests made meanwhile wait for the next frame.
  const std::vector<std::uint32_t> doomed = std::exchange(doomed_, {});
  for (const std::uint32_t index : doomed) end(index, failures);
  std::uint32_t spawned = 0;
  for (std::size_t left = waiting_.size(); left > 0 && spawned < limit; --left) {
    Waiting next = std::move(waiting_.front());
    waiting_.pop_front();
    if (slots_[next.id.index].doomed) {
      discard(next.id.index);
      continue;
    }
    spawned += begin(std::move(next), failures);
  }
  return spawned;
}

// False if its `created` threw: the entity is then not created.
bool EntityWorld::begin(Waiting waiting, Failures& failures) {
  const std::uint32_t index = waiting.id.index;
  Entity& entity = *slots_[index].entity;
  EntityDef& def = waiting.def;
  entity.world_ = this;
  entity.id_ = waiting.id;
  if (!failures.guard([&] { entity.created(engine_, def); })) {
    discard(index);
    return false;
  }
  entity.name_ = std::move(def.name);
  entity.pose_ = def.pose;
  if (def.physics && def.simulated) {
    entity.pose_ = def.physics->pose;
    entity.velocity_ = def.physics->velocity;
    entity.body_ = engine_.simulation().make_handle();
    commands_.add(entity.body_, *def.physics);
  } else if (def.physics) {
    entity.pose_ = def.physics->pose;
  }
  entity.pose_.rotation = normalize(entity.pose_.rotation);
  if (def.graphics && def.drawn) show(entity, *def.graphics);
  Slot& slot = slots_[index];  // `created` may have spawned others
  slot.alive = true;
  slot.tick = def.tick;
  slot.entry = static_cast<std::uint32_t>(list(def.tick).size());
  list(def.tick).push_back(index);
  ++alive_;
  // Destroyed during creation: like any destroyed entity, it lives until the next frame.
  if (slot.doomed) doomed_.push_back(index);
  return true;
}

void EntityWorld::end(std::uint32_t index, Failures& failures) {
  Entity& entity = *slots_[index].entity;
  failures.guard([&] { entity.destroyed(engine_); });
  hide(entity);
  if (entity.has_physics()) {
    commands_.push({CommandKind::remove, entity.body_, {}, {}, {}, 0});
    engine_.simulation().release_handle(entity.body_);
  }
  Slot& slot = slots_[index];
  std::vector<std::uint32_t>& ticking = list(slot.tick);
  slots_[ticking.back()].entry = slot.entry;
  ticking[slot.entry] = ticking.back();
  ticking.pop_back();
  slot.alive = false;
  --alive_;
  discard(index);
}

void EntityWorld::discard(std::uint32_t index) {
  slots_[index].entity.reset();
  free_.push_back(index);
}

// --- ticks -------------------------------------------------------------------------------------------------------

void EntityWorld::run_ticks(const Tick& tick, Failures& failures) {
  // The list does not change while it runs.
  for (const std::uint32_t index : list(tick.phase)) failures.guard([&] { slots_[index].entity->tick(tick); });
}

// --- drawing -----------------------------------------------------------------------------------------------------

void EntityWorld::show(Entity& entity, const GraphicsBody& graphics) {
  entity.drawn_ = static_cast<std::uint32_t>(looks_.size());
  looks_.push_back(graphics);
  drawn_.push_back({entity.id_.index, entity.body_});
  ++revision_;
}

void EntityWorld::hide(Entity& entity) {
  if (entity.drawn_ == nowhere) return;
  const std::uint32_t index = std::exchange(entity.drawn_, nowhere);
  if (index + 1 < looks_.size()) {
    looks_[index] = std::move(looks_.back());
    drawn_[index] = drawn_.back();
    slots_[drawn_[index].slot].entity->drawn_ = index;
  }
  looks_.pop_back();
  drawn_.pop_back();
  ++revision_;
}

void EntityWorld::describe(DrawFrame& frame, const SimulationState& from, const SimulationState& to, float share) {
  draw_poses_.resize(drawn_.size());
  for (std::size_t i = 0; i < drawn_.size(); ++i) {
    const Drawn& drawn = drawn_[i];
    Pose pose;
    if (!to.contains(drawn.body))
      pose = slots_[drawn.slot].entity->pose_;
    else if (share < 1 && from.contains(drawn.body))
      pose = between(from.poses[drawn.body.index], to.poses[drawn.body.index], share);
    else
      pose = to.poses[drawn.body.index];
    draw_poses_[i] = pose * looks_[i].local;
  }
  frame.bodies = looks_;
  frame.poses = draw_poses_;
  frame.revision = revision_;
}

// --- entities ----------------------------------------------------------------------------------------------------

const Pose& Entity::pose() const {
  const SimulationState* state = world_ ? world_->state() : nullptr;
  return state && state->contains(body_) ? state->poses[body_.index] : pose_;
}

const Velocity& Entity::velocity() const {
  const SimulationState* state = world_ ? world_->state() : nullptr;
  return state && state->contains(body_) ? state->velocities[body_.index] : velocity_;
}

void Entity::command(CommandKind kind, Vec3 a, Vec3 b, Quat rotation) {
  if (has_physics()) world_->commands_.push({kind, body_, a, b, rotation, 0});
}

void Entity::set_pose(const Pose& pose) {
  pose_ = {pose.position, 0, normalize(pose.rotation)};
  command(CommandKind::set_pose, pose.position, {}, pose.rotation);
}

void Entity::move_to(const Pose& pose) { command(CommandKind::move_to, pose.position, {}, pose.rotation); }
void Entity::set_velocity(Vec3 linear, Vec3 angular) { command(CommandKind::set_velocity, linear, angular); }
void Entity::add_velocity(Vec3 linear, Vec3 angular) { command(CommandKind::add_velocity, linear, angular); }
void Entity::apply_force(Vec3 force) { command(CommandKind::force, force); }
void Entity::apply_force_at(Vec3 force, Vec3 point) { command(CommandKind::force_at, force, point); }
void Entity::apply_torque(Vec3 torque) { command(CommandKind::torque, torque); }
void Entity::apply_impulse(Vec3 impulse) { command(CommandKind::impulse, impulse); }
void Entity::apply_impulse_at(Vec3 impulse, Vec3 point) { command(CommandKind::impulse_at, impulse, point); }
void Entity::apply_angular_impulse(Vec3 impulse) { command(CommandKind::angular_impulse, impulse); }

void Entity::set_colour(Colour colour) {
  if (drawn_ == nowhere || world_->looks_[drawn_].colour == colour) return;
  world_->looks_[drawn_].colour = colour;
  ++world_->revision_;
}

}  // namespace fathom::engine
