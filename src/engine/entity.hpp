// Entities: everything in the engine's world (dissertation, section 3.1). An entity has a physics body and a graphics
// body, either of which may be absent or unregistered, and logic that ticks in a chosen phase of a step.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>
#include <functional>
#include <optional>
#include <string>

#include "engine/command.hpp"
#include "engine/front_end.hpp"

namespace fathom::engine {

class Engine;
class EntityWorld;

struct EntityId {
  std::uint32_t index = 0xffffffffu;
  std::uint32_t generation = 0;

  friend bool operator==(EntityId, EntityId) = default;
};

/// When an entity's logic runs, relative to the simulation of a step.
enum class TickPhase : std::uint8_t {
  none,
  before,  ///< its commands act in this step
  during,  ///< concurrent with the step: sees the last state, its commands act in the next step
  after,   ///< sees the step's result (in modes `ahead` and `async`: the newest result available to draw)
};

/// Data of a tick.
struct Tick {
  Engine& engine;
  TickPhase phase;
  std::uint64_t step;  ///< number of the current step, from 1
  double time;         ///< s simulated at its end
  float dt;            ///< s
};

/// An entity's definition; `Entity::created` may still change it.
struct EntityDef {
  std::string name{};
  std::optional<BodyDef> physics{};
  std::optional<GraphicsBody> graphics{};
  bool simulated = true;  ///< register the physics body with the simulation
  bool drawn = true;      ///< register the graphics body with the renderer
  Pose pose{};            ///< pose of an entity without a registered physics body
  TickPhase tick = TickPhase::none;
};

/// Derive from it to give an entity logic and data. The engine's thread calls all functions. They may call any function
/// of the engine except `frame`, `run` and `finish`, may spawn and destroy entities, and may throw (see `Engine::run`).
class Entity {
 public:
  Entity() = default;
  virtual ~Entity() = default;
  Entity(const Entity&) = delete;
  Entity& operator=(const Entity&) = delete;

  /// Called at creation, before bodies are registered; may change `def`. If it throws, the entity is not created.
  virtual void created(Engine&, EntityDef&) {}
  virtual void tick(const Tick&) {}
  virtual void destroyed(Engine&) {}

  EntityId id() const { return id_; }
  const std::string& name() const { return name_; }
  bool has_physics() const { return body_.generation != 0; }
  BodyHandle body() const { return body_; }

  /// Pose and velocity in the newest state available to draw; until then, those of its definition.
  const Pose& pose() const;
  const Velocity& velocity() const;

  // Commands for the next step that has not begun. Without a registered physics body all except set_pose are ignored.
  // The simulation refuses non-finite values, and forces and impulses on bodies that are not dynamic; either ends the
  // run with an error.
  void set_pose(const Pose& pose);
  void move_to(const Pose& pose);  ///< for a kinematic body, at the step's end; see World::move_to
  void set_velocity(Vec3 linear, Vec3 angular);
  void add_velocity(Vec3 linear, Vec3 angular);  ///< added to its velocity when the step begins
  void apply_force(Vec3 force);                  ///< N at the centre of mass, for one step
  void apply_force_at(Vec3 force, Vec3 point);   ///< N at a point (m, world)
  void apply_torque(Vec3 torque);                ///< N·m
  void apply_impulse(Vec3 impulse);              ///< N·s
  void apply_impulse_at(Vec3 impulse, Vec3 point);
  void apply_angular_impulse(Vec3 impulse);  ///< N·m·s
  void set_colour(Colour colour);

 private:
  friend class EntityWorld;
  void command(CommandKind kind, Vec3 a, Vec3 b = {}, Quat rotation = {});

  EntityWorld* world_ = nullptr;
  EntityId id_;
  std::string name_;
  BodyHandle body_;
  std::uint32_t drawn_ = 0xffffffffu;  // index in the draw list
  Pose pose_;
  Velocity velocity_;
};

/// Logic as a function instead of a class.
using TickFunction = std::function<void(Entity&, const Tick&)>;

}  // namespace fathom::engine
