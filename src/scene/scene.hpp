// A scene: the start of a run, whatever made it (a file, a built-in environment, a test).
#pragma once

#include <cstddef>
#include <cstdint>
#include <fathom/world.hpp>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "scene/random.hpp"

namespace fathom {

/// A random change of every dynamic body's velocity before the steps 0, interval, 2·interval, …
struct Kicks {
  int interval = 30;     ///< steps
  float linear = 0.5f;   ///< m/s, the largest change per axis
  float angular = 0.5f;  ///< rad/s, the largest change per axis
  std::uint64_t seed = 1;
};

/// Bodies that come and go: before the steps interval, 2·interval, … the next one leaves the world and returns at its
/// source, otherwise as at the start.
struct Stream {
  int interval = 1;           ///< steps
  std::size_t first = 0;      ///< in Scene::bodies
  std::vector<Pose> sources;  ///< of this body and the following ones

  /// The body that leaves and returns after `steps` steps.
  std::optional<std::size_t> due(std::uint64_t steps) const;
};

/// Kinematic bodies that orbit an axis together, at constant speed from their initial positions.
struct Orbit {
  std::size_t first = 0, count = 0;  ///< in Scene::bodies
  Vec3 centre, axis;                 ///< a point on the axis (m) and its unit vector
  double speed = 0;                  ///< turns per second
  bool is_rigid = true;              ///< they rotate with the orbit, like a drum's parts

  /// Pose after `time` (s) of a body that started at `start`.
  Pose at(const Pose& start, double time) const;
};

struct NamedBody {
  std::string name;
  std::size_t body = 0;  ///< index in Scene::bodies
};

/// A joint between two of Scene::bodies.
struct SceneJoint {
  std::size_t a = 0, b = 0;
  JointDef def;  ///< without its bodies

  /// Places both anchors at one world point (m).
  void anchor_at(Vec3 point, std::span<const BodyDef> bodies);
  /// Gives both frames this world orientation, at which angles are zero; the anchors stay.
  void turn_to(Quat rotation, std::span<const BodyDef> bodies);
};

struct Scene {
  std::string name;
  WorldDef world;
  /// If `world` is from a file: the preset, and where each setting is ("scene.toml:12"), by the name of its
  /// configuration key ("simulator.solver").
  std::optional<Preset> preset;
  std::map<std::string, std::string, std::less<>> said;
  std::vector<BodyDef> bodies;
  std::vector<NamedBody> names;  ///< of the named bodies
  std::vector<SceneJoint> joints;
  /// Pairs of Scene::bodies that do not collide, see `World::exclude`.
  std::vector<std::pair<std::size_t, std::size_t>> excluded;
  std::optional<Kicks> kicks;
  std::optional<Stream> stream;
  std::optional<Orbit> orbit;
  std::optional<float> ground_height;  ///< m, the ground's surface, if any; reference for quality
  std::optional<Aabb> container;       ///< m; no centre of mass may leave it
};

/// Definitions with which the stream's bodies return, from the first on.
std::vector<BodyDef> streamed_bodies(const Scene& scene);

/// Number of dynamic bodies.
std::size_t dynamic_body_count(const Scene& scene);

/// A scene's kicks, step by step.
class Kicker {
 public:
  struct Kick {
    std::size_t body = 0;  ///< index in Scene::bodies
    Vec3 linear, angular;  ///< to add to its velocity (m/s, rad/s)
  };

  explicit Kicker(const Scene& scene);
  /// The kicks due after `steps` steps. Call once per step, in order. Valid until the next call.
  std::span<const Kick> due(std::uint64_t steps);

 private:
  std::optional<Kicks> kicks_;
  std::vector<std::size_t> dynamic_bodies_;
  Random random_;
  std::vector<Kick> due_;
};

/// A scene's orbit, step by step.
class Orbiter {
 public:
  struct Target {
    std::size_t body = 0;  ///< index in Scene::bodies
    Pose pose;             ///< at the end of the step
    Velocity velocity;     ///< that takes the body there
  };

  /// The scene must have one.
  explicit Orbiter(const Scene& scene);
  /// Targets of the step after `steps` steps. Valid until the next call.
  std::span<const Target> due(std::uint64_t steps);

 private:
  Orbit orbit_;
  double dt_;
  std::vector<Pose> starts_;
  std::vector<Target> due_;
};

/// A scene's bodies and joints in a world, and the scene's actions over time. The world must outlive it.
class SceneInstance {
 public:
  /// Adds the scene's bodies and joints, and sorts them (`World::optimize_broad_phase`). Throws what `World::add` and
  /// `World::add_joint` throw, naming the body or joint.
  SceneInstance(const Scene& scene, World& world);

  /// The scene's actions before the next step: kicks, stream, orbit. Depends only on the number of steps.
  void prepare_step();

  /// The body id of each of Scene::bodies.
  const std::vector<BodyId>& ids() const { return ids_; }
  /// For callers that run the stream instead of `prepare_step`: the body that returned.
  void replaced(std::size_t body, BodyId id) { ids_[body] = id; }

 private:
  void add_bodies(const Scene& scene);
  void add_joints(const Scene& scene);

  World& world_;
  std::vector<BodyId> ids_;
  Kicker kicker_;
  std::optional<Stream> stream_;
  std::vector<BodyDef> streamed_;
  std::optional<Orbiter> orbiter_;
};

}  // namespace fathom
