// A scene's actions over time (kicks, a stream, an orbit) as commands of steps.
#pragma once

#include <optional>
#include <vector>

#include "engine/simulation.hpp"
#include "scene/scene.hpp"

namespace fathom::engine {

/// The commands of `SceneInstance::prepare_step`, in its order. Skips bodies that no longer exist. A body that leaves
/// the world and returns keeps its handle.
class SceneScript final : public StepScript {
 public:
  /// `bodies`: the handle of each of Scene::bodies; generation 0 if it has none.
  SceneScript(const Scene& scene, std::vector<BodyHandle> bodies);

  void before_step(std::uint64_t step, const CommandRunner& runner, CommandList& commands) override;

  /// Whether the scene does anything over time.
  static bool is_needed(const Scene& scene) { return scene.kicks || scene.stream || scene.orbit; }

 private:
  Kicker kicker_;
  std::optional<Orbiter> orbiter_;
  std::optional<Stream> stream_;
  std::vector<BodyDef> streamed_;
  std::vector<BodyHandle> bodies_;
};

}  // namespace fathom::engine
