// The interface through which every engine is measured. One adapter file per engine; engines.cpp lists them.
//
// An adapter adopts the scene's definitions (shapes, masses, friction, gravity, Δt) and leaves everything else at the
// engine's own defaults, except that bodies neither sleep nor are damped.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scene/scene.hpp"

namespace fathom::peers {

class Engine {
 public:
  Engine() = default;
  virtual ~Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  /// One step of the scene's Δt.
  virtual void step() = 0;
  /// Poses and velocities of Scene::bodies, in that order.
  virtual void read(std::span<Pose> poses, std::span<Velocity> velocities) const = 0;
  virtual void set_velocity(std::size_t body, const Velocity& velocity) = 0;
  /// Moves a kinematic body within the next step.
  virtual void move(const Orbiter::Target& target) { set_velocity(target.body, target.velocity); }
  /// Errors that the engine itself has reported so far; empty if none.
  virtual std::string trouble() const { return {}; }
};

struct EngineKind {
  std::string_view name;
  std::string version;
  bool threaded;  ///< false: always runs on one thread
  std::unique_ptr<Engine> (*create)(const Scene& scene, int threads);
};

/// The engines of this build that this machine can run, Fathom first. The first call queries GPU drivers.
const std::vector<EngineKind>& engines();
/// The engine with that name; throws an `Error{unavailable}` that lists this build's engines.
const EngineKind& find_engine(std::string_view name);

/// Whether bodies can share the engine's object for a shape.
bool is_same(const Shape& a, const Shape& b);
/// Throws `Error{unavailable}`: the engine, or its adapter, does not support it.
[[noreturn]] void refuse_scene(std::string_view engine, std::string_view what);
/// Refuses a mesh or a height field.
[[noreturn]] void refuse_shape(std::string_view engine);
/// Refuses rounded hulls, of which engines would get the cores.
void refuse_rounded(std::string_view engine, const Scene& scene);
/// Refuses a scene with joints.
void refuse_joints(std::string_view engine, const Scene& scene);
/// Refuses all joints but rigid ball joints between bodies that do not collide: adapters make no others.
void require_plain_joints(std::string_view engine, const Scene& scene);
/// The joints that adapters can make.
enum class PeerJoint {
  ball,   ///< free to turn
  limb,   ///< a ball joint with a cone about A's axis x and bounds on the twist
  hinge,  ///< about the axis x, with or without bounds and friction
};
/// Refuses any other joint, and one that is a spring, breaks, or lets its bodies collide.
PeerJoint peer_joint(std::string_view engine, const JointDef& joint);
/// Mass of a dynamic body (kg).
float mass_of(const BodyDef& body);

// Each is defined by its adapter; only those that CMake found are built.
EngineKind fathom_engine();
EngineKind fathom_gpu_engine();
EngineKind bullet_engine();
EngineKind ode_engine();
EngineKind mujoco_engine();
EngineKind box3d_engine();
EngineKind jolt_engine();
EngineKind physx_engine();
EngineKind physx_tgs_engine();
EngineKind physx_gpu_engine();

// Whether this machine has what the two GPU engines need.
bool fathom_gpu_is_there();
bool physx_gpu_is_there();

}  // namespace fathom::peers
