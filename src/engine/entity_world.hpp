// The engine's world: owns the entities, runs their ticks, and creates and destroys them between steps.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <vector>

#include "engine/entity.hpp"
#include "engine/failures.hpp"
#include "engine/simulation.hpp"

namespace fathom::engine {

class EntityWorld {
 public:
  EntityWorld(Engine& engine, std::uint32_t spawns_per_frame) : engine_(engine), spawn_limit_(spawns_per_frame) {}
  ~EntityWorld();
  EntityWorld(const EntityWorld&) = delete;
  EntityWorld& operator=(const EntityWorld&) = delete;

  /// Requests an entity. Its id is valid at once; it spawns at the start of the next frame, or of a later one if more
  /// are waiting than may spawn per frame.
  EntityId spawn(EntityDef def, std::unique_ptr<Entity> entity = {});
  EntityId spawn(EntityDef def, TickFunction tick);
  /// Destroys an entity at the start of the next frame; until then it ticks. False if it no longer exists.
  bool destroy(EntityId id);

  /// Joins two living entities' bodies before the next step that has not begun; `definition`'s own bodies are ignored.
  /// The joint ends with either body. Throws `Error{stale_id}` if one has no registered physics body.
  void join(EntityId a, EntityId b, const JointDef& definition);
  /// Sets all other parameters of the joint from `a` to `b` with this definition's user data: axes, frames, limits,
  /// drives, springs, breaking limits (see `World::change_joint`). Throws like `join`.
  void change_joint(EntityId a, EntityId b, const JointDef& definition);
  /// Removes the joint from `a` to `b` with this user data. Throws like `join`.
  void unjoin(EntityId a, EntityId b, std::uint64_t user_data = 0);

  /// Keeps two living entities' bodies from colliding, from the next step that has not begun, or reverses that (see
  /// `World::exclude`). Throws like `join`.
  void exclude(EntityId a, EntityId b);
  void include(EntityId a, EntityId b);

  /// The living entity; null before it spawns and after it is destroyed.
  Entity* find(EntityId id);
  Entity* find(std::string_view name);
  std::uint32_t count() const { return alive_; }
  /// Entities waiting because of the spawn limit.
  std::size_t waiting() const { return waiting_.size(); }
  std::uint32_t spawn_limit() const { return spawn_limit_; }

  // For the engine.
  /// Destroys and creates entities, creating at most `limit`. Returns how many spawned. Exceptions of callbacks go to
  /// `failures`.
  std::uint32_t take_over_changes(std::uint32_t limit, Failures& failures);
  void run_ticks(const Tick& tick, Failures& failures);
  /// The game's commands since the last call.
  CommandList& commands() { return commands_; }
  void set_state(StatePtr state) { state_ = std::move(state); }
  const SimulationState* state() const { return state_.get(); }
  /// The poses to draw, `share` (0 … 1) of the way from one state to the other; fills bodies, poses and revision.
  void describe(DrawFrame& frame, const SimulationState& from, const SimulationState& to, float share);

 private:
  friend class Entity;

  struct Slot {
    std::unique_ptr<Entity> entity;
    std::uint32_t generation = 0;
    TickPhase tick = TickPhase::none;
    std::uint32_t entry = 0;  // index in its phase's list
    bool alive = false;       // spawned
    bool doomed = false;
  };
  struct Drawn {
    std::uint32_t slot;
    BodyHandle body;
  };
  struct Waiting {
    EntityId id;
    EntityDef def;
  };

  void order_joint(CommandKind kind, EntityId a, EntityId b, const JointDef& definition);
  bool begin(Waiting waiting, Failures& failures);
  void end(std::uint32_t index, Failures& failures);
  void discard(std::uint32_t index);
  void show(Entity& entity, const GraphicsBody& graphics);
  void hide(Entity& entity);
  std::vector<std::uint32_t>& list(TickPhase phase) { return ticking_[static_cast<std::size_t>(phase)]; }

  Engine& engine_;
  std::uint32_t spawn_limit_;
  std::uint32_t alive_ = 0;
  std::vector<Slot> slots_;
  std::vector<std::uint32_t> free_;
  std::deque<Waiting> waiting_;
  std::vector<std::uint32_t> doomed_;
  std::vector<std::uint32_t> ticking_[4];  // by phase: slots
  CommandList commands_;
  StatePtr state_;

  std::vector<GraphicsBody> looks_;
  std::vector<Drawn> drawn_;  // the owner of each look
  std::vector<Pose> draw_poses_;
  std::uint64_t revision_ = 1;
};

}  // namespace fathom::engine
