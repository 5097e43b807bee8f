// The simulation behind the window: a scene in a world, and the controls' actions on it.
#pragma once

#include <cstdint>
#include <deque>
#include <fathom/world.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scene/scene.hpp"

namespace fathom::viewer {

/// Choices made in the panel. Absent values are the scene's own.
struct Choice {
  std::string scene{};  ///< an environment's name or a scene file's path
  std::optional<std::int64_t> bodies{};
  std::optional<SimulatorKind> simulator{};
  std::string device{};  ///< for the device simulator; empty: the scene's own
  std::optional<int> threads{};
  std::optional<int> substeps{};
  std::optional<Solver> solver{};
  std::optional<BroadPhase> broad_phase{};
  std::optional<bool> sleep{};

  friend bool operator==(const Choice&, const Choice&) = default;
};
/// A simulator and its back end, as offered by the panel.
struct SimulatorChoice {
  std::string name;
  SimulatorKind kind = SimulatorKind::native;
  std::string device;
};
using SceneMaker = std::function<Scene(const Choice&)>;

class Session {
 public:
  /// Throws what `make` and `World` throw.
  Session(SceneMaker make, Choice choice);

  /// Starts another scene, or restarts the same one. If that throws, the old one stays.
  void choose(const Choice& choice);
  void reset() { choose(choice_); }
  void step();

  World& world() { return *world_; }
  const World& world() const { return *world_; }
  const Scene& scene() const { return *scene_; }
  const Choice& choice() const { return choice_; }
  /// Reverts the last action: a choice of scene or setting, a reset, a shot, a grab, a step after `remember`. Restores
  /// the world before it, bit for bit. False if there is nothing to revert.
  bool undo();
  std::size_t undoable() const { return past_.size(); }
  /// Saves the state for `undo`. The last few are kept.
  void remember();
  /// Counts scenes started, so callers know when to drop data of the last one.
  std::uint64_t generation() const { return generation_; }
  /// Times of the last steps, oldest first.
  const std::deque<StageTimes>& history() const { return history_; }

  // Picking: a critically damped target joint of 4 Hz from the grabbed point to the hand; an equivalent force if the
  // world has no joints (Partition::cells).
  /// Grabs the dynamic body under a ray; false if there is none.
  bool grab(Vec3 origin, Vec3 direction);
  /// Moves the hand along the ray to the depth at which the body was grabbed.
  void drag(Vec3 origin, Vec3 direction, Vec3 view_direction);
  void release();
  struct Grip {
    BodyId body;
    Vec3 anchor;    ///< m, in the body's frame
    Vec3 hand;      ///< m, world
    BodyId holder;  ///< the joint's other body: fixed, touches nothing
    JointId joint;  ///< none if the world has no joints
  };
  const std::optional<Grip>& grip() const { return grip_; }

  /// Shoots a box of half a metre and 10 kg at 25 m/s.
  BodyId shoot(Vec3 from, Vec3 direction);

 private:
  /// The state before an action: a whole world that has been replaced, or a snapshot of the one still running.
  struct Past {
    Choice choice;
    std::unique_ptr<Scene> scene;
    std::unique_ptr<World> world;
    std::unique_ptr<SceneInstance> instance;
    std::vector<std::byte> snapshot;
    std::optional<BodyId> holder;  ///< of a grip at that time; exists only in the snapshot
  };
  void keep(Past past);
  void join(Vec3 point);
  void pull();
  void pull_by_force();

  SceneMaker make_;
  Choice choice_;
  // In this order: the instance refers to the others.
  std::unique_ptr<Scene> scene_;
  std::unique_ptr<World> world_;
  std::unique_ptr<SceneInstance> instance_;
  std::uint64_t generation_ = 0;
  std::deque<StageTimes> history_;
  std::optional<Grip> grip_;
  std::deque<Past> past_;  // the latest last
};

}  // namespace fathom::viewer
