// A scene: what a run starts from, whatever made it (a file, a built-in environment, a test).
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

/// Bodies that come and go: before the steps interval, 2·interval, … one of them leaves the world and comes back at its
/// source, as it was at the start but for that, each in its turn.
struct Stream {
  int interval = 1;           ///< steps
  std::size_t first = 0;      ///< in Scene::bodies
  std::vector<Pose> sources;  ///< of this body and the next ones, as many as there are

  /// Who leaves and comes back when `steps` steps have been made.
  std::optional<std::size_t> due(std::uint64_t steps) const;
};

/// Kinematic bodies that go round an axis together, at a steady speed from where they are at the start.
struct Orbit {
  std::size_t first = 0, count = 0;  ///< in Scene::bodies
  Vec3 centre, axis;                 ///< a point of the axis (m) and its unit vector
  double speed = 0;                  ///< turns a second
  bool is_rigid = true;              ///< they turn with it, as a drum's parts do

  /// Where one of Scene::bodies that started at `start` is after `time` (s).
  Pose at(const Pose& start, double time) const;
};

struct NamedBody {
  std::string name;
  std::size_t body = 0;  ///< index in Scene::bodies
};

/// A joint between two of Scene::bodies.
struct SceneJoint {
  std::size_t a = 0, b = 0;
  JointDef def;  ///< but for its bodies

  /// Both anchors at one point of the world (m).
  void anchor_at(Vec3 point, std::span<const BodyDef> bodies);
  /// Both frames turned so in the world, where angles start at zero; the anchors stay.
  void turn_to(Quat rotation, std::span<const BodyDef> bodies);
};

struct Scene {
  std::string name;
  WorldDef world;
  /// Of `world`, where a file says it: the set of algorithms, and where each setting is ("scene.toml:12"), by the
  /// name of the configuration's key ("simulator.solver").
  std::optional<Preset> preset;
  std::map<std::string, std::string, std::less<>> said;
  std::vector<BodyDef> bodies;
  std::vector<NamedBody> names;  ///< of the bodies that have one
  std::vector<SceneJoint> joints;
  /// Pairs of Scene::bodies that do not collide, see `World::exclude`.
  std::vector<std::pair<std::size_t, std::size_t>> excluded;
  std::optional<Kicks> kicks;
  std::optional<Stream> stream;
  std::optional<Orbit> orbit;
  std::optional<float> ground_height;  ///< m, the ground's surface where the scene has one; quality is measured from it
  std::optional<Aabb> container;       ///< what no centre of mass may leave (m)
};

/// What the bodies of the scene's stream come back as, from the first on.
std::vector<BodyDef> streamed_bodies(const Scene& scene);

/// Bodies that forces and contacts move.
std::size_t dynamic_body_count(const Scene& scene);

/// A scene's kicks, step after step.
class Kicker {
 public:
  struct Kick {
    std::size_t body = 0;  ///< index in Scene::bodies
    Vec3 linear, angular;  ///< to add to its velocity (m/s, rad/s)
  };

  explicit Kicker(const Scene& scene);
  /// The kicks due when `steps` steps have been made. To be asked once for every step, in order. Valid until the
  /// next call.
  std::span<const Kick> due(std::uint64_t steps);

 private:
  std::optional<Kicks> kicks_;
  std::vector<std::size_t> dynamic_bodies_;
  Random random_;
  std::vector<Kick> due_;
};

/// A scene's orbit, step after step.
class Orbiter {
 public:
  struct Target {
    std::size_t body = 0;  ///< index in Scene::bodies
    Pose pose;             ///< at the end of the step
    Velocity velocity;     ///< that takes it there
  };

  /// The scene must have one.
  explicit Orbiter(const Scene& scene);
  /// Of the step to make when `steps` steps have been made. Valid until the next call.
  std::span<const Target> due(std::uint64_t steps);

 private:
  Orbit orbit_;
  double dt_;
  std::vector<Pose> starts_;
  std::vector<Target> due_;
};

/// A scene's bodies and joints in a world, and what the scene does to them over time. The world must outlive it.
class SceneInstance {
 public:
  /// Adds the scene's bodies and joints, and sorts them (`World::optimize_broad_phase`). Throws what `World::add` and
  /// `World::add_joint` throw, saying of which one.
  SceneInstance(const Scene& scene, World& world);

  /// What the scene does before the next step: its kicks, its stream, its orbit. Depends on the number of steps only.
  void prepare_step();

  /// The body of each of Scene::bodies.
  const std::vector<BodyId>& ids() const { return ids_; }
  /// For those who carry the stream out in place of `prepare_step`: the body that came back.
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
