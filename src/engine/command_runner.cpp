#include "engine/command_runner.hpp"

#include <algorithm>
#include <span>
#include <string>

namespace fathom::engine {
namespace {

// Handles are assigned from 0 up, so one far beyond a world's capacity is invalid.
constexpr std::uint32_t max_handles = 1u << 28;

std::string text(BodyHandle handle) {
  return "{index " + std::to_string(handle.index) + ", generation " + std::to_string(handle.generation) + "}";
}

bool is_handle(BodyHandle handle) { return handle.index < max_handles && handle.generation != 0; }

/// Number of leading commands that add bodies with consecutive definitions.
std::size_t additions(std::span<const Command> commands) {
  std::size_t count = 0;
  while (count < commands.size() && commands[count].kind == CommandKind::add && is_handle(commands[count].body) &&
         commands[count].definition == commands.front().definition + count)
    ++count;
  return count;
}

}  // namespace

CommandRunner::CommandRunner(World& world) : world_(&world) {
  for (const BodyId id : world.bodies()) note({id.index, id.generation}, id);
}

bool CommandRunner::contains(BodyHandle handle) const {
  return handle.generation != 0 && handle.index < entries_.size() &&
         entries_[handle.index].generation == handle.generation;
}

BodyId CommandRunner::body(BodyHandle handle) const {
  if (contains(handle)) return entries_[handle.index].body;
  throw Error(ErrorCode::stale_id, "there is no body with the handle " + text(handle) +
                                       ": it was removed or never added; ask EntityWorld::find before using an entity");
}

BodyHandle CommandRunner::handle(BodyId body) const {
  return body.index < handles_.size() && world_->contains(body) ? handles_[body.index] : BodyHandle{};
}

void CommandRunner::note(BodyHandle handle, BodyId body) {
  if (handle.index >= entries_.size()) entries_.resize(handle.index + 1);
  entries_[handle.index] = {handle.generation, body};
  if (body.index >= handles_.size()) handles_.resize(body.index + 1);
  handles_[body.index] = handle;
}

void CommandRunner::set_entries(std::vector<Entry> entries) {
  entries_.clear();
  handles_.clear();
  for (std::uint32_t index = 0; index < entries.size(); ++index) {
    const Entry& entry = entries[index];
    if (entry.generation == 0) continue;
    if (!world_->contains(entry.body))
      throw Error(ErrorCode::file,
                  "the handle " + text({index, entry.generation}) + " stands for a body that is not there");
    note({index, entry.generation}, entry.body);
  }
}

void CommandRunner::run(const CommandList& list) {
  for (std::span<const Command> left = list.commands(); !left.empty();) {
    const std::span<const Command> next = left.first(std::max<std::size_t>(1, additions(left)));
    left = left.subspan(next.size());
    if (next.size() > 1 && add_together(next, list)) continue;
    for (const Command& command : next) {
      try {
        run(command, list);
      } catch (const Error& error) {
        throw Error(error.code(), "body " + text(command.body) + ": " + error.what());
      }
    }
  }
}

// False, with none added, if the world refuses one; adding them one by one then finds which.
bool CommandRunner::add_together(std::span<const Command> additions, const CommandList& list) {
  const std::size_t first = additions.front().definition;
  if (first + additions.size() > list.definitions().size()) return false;
  std::vector<BodyId> ids;
  try {
    ids = world_->add_bodies(std::span(list.definitions()).subspan(first, additions.size()));
  } catch (const Error&) {
    return false;
  }
  for (std::size_t i = 0; i < ids.size(); ++i) note(additions[i].body, ids[i]);
  return true;
}

void CommandRunner::add(BodyHandle handle, const BodyDef& definition) {
  if (!is_handle(handle)) throw Error(ErrorCode::invalid_argument, "add body: this is not a handle");
  note(handle, world_->add(definition));
}

void CommandRunner::run(const Command& c, const CommandList& list) {
  if (c.kind == CommandKind::add) return add(c.body, list.definitions().at(c.definition));
  if (c.kind == CommandKind::set_gravity) return world_->set_gravity(c.a);
  const BodyId id = body(c.body);
  switch (c.kind) {
    case CommandKind::remove:
      world_->remove(id);
      entries_[c.body.index] = {};
      return;
    case CommandKind::set_pose:
      return world_->set_pose(id, {c.a, 0, c.rotation});
    case CommandKind::move_to:
      return world_->move_to(id, {c.a, 0, c.rotation});
    case CommandKind::set_velocity:
      return world_->set_velocity(id, c.a, c.b);
    case CommandKind::add_velocity:
      return world_->add_velocity(id, c.a, c.b);
    case CommandKind::force:
      return world_->apply_force(id, c.a);
    case CommandKind::force_at:
      return world_->apply_force_at(id, c.a, c.b);
    case CommandKind::torque:
      return world_->apply_torque(id, c.a);
    case CommandKind::impulse:
      return world_->apply_impulse(id, c.a);
    case CommandKind::impulse_at:
      return world_->apply_impulse_at(id, c.a, c.b);
    case CommandKind::angular_impulse:
      return world_->apply_angular_impulse(id, c.a);
    case CommandKind::wake:
      return world_->wake(id);
    case CommandKind::set_gravity_scale:
      return world_->set_gravity_scale(id, c.a.x);
    case CommandKind::set_damping:
      return world_->set_damping(id, c.a.x, c.a.y);
    case CommandKind::set_material:
      return world_->set_material(
          id, {.friction = c.a.x, .restitution = c.a.y, .rolling_resistance = c.a.z, .surface_velocity = c.b});
    case CommandKind::join:
    case CommandKind::change_joint:
    case CommandKind::unjoin:
    case CommandKind::exclude:
    case CommandKind::include:
      return run(c.kind, id, list.joints().at(c.definition));
    case CommandKind::add:
    case CommandKind::set_gravity:
      break;
  }
}

void CommandRunner::run(CommandKind kind, BodyId a, const JointOrder& order) {
  JointDef def = order.def;
  def.a = a, def.b = body(order.other);
  if (kind == CommandKind::exclude) return world_->exclude(def.a, def.b);
  if (kind == CommandKind::include) return world_->include(def.a, def.b);
  if (kind == CommandKind::join) {
    world_->add_joint(def);
    return;
  }
  const JointId joint = world_->find_joint(def.a, def.b, def.user_data);
  if (kind == CommandKind::unjoin) return world_->remove_joint(joint);
  world_->change_joint(joint, def);
}

}  // namespace fathom::engine
