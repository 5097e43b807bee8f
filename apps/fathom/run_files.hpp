// What a run produces besides its figures: a recording and a trace.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "engine/recording.hpp"
#include "engine/scene_script.hpp"
#include "engine/trace.hpp"
#include "scene/scene.hpp"

namespace fathom::cli {

struct RunFileSettings {
  std::string record;  ///< paths; empty for none
  std::string trace;
  engine::RecordSettings recording;
};

/// Accompanies the steps of a scene's world. If no file is wanted, only does the scene's own part.
class RunFiles {
 public:
  /// Throws `Error{file}` if a file cannot be written.
  RunFiles(const RunFileSettings& settings, const Scene& scene, SceneInstance& instance, World& world);

  /// The scene's actions before the next step, recorded.
  void prepare_step();
  void after_step(double step_ms);
  /// Completes the files. Throws `Error{file}`.
  void finish();

 private:
  std::optional<engine::trace::Session> trace_;
  SceneInstance& instance_;
  World& world_;
  std::string device_track_;
  // While recording:
  std::unique_ptr<engine::Recorder> recorder_;
  std::optional<engine::CommandRunner> runner_;
  std::optional<engine::SceneScript> script_;
  std::optional<Stream> stream_;
  std::vector<engine::BodyHandle> handles_;  // by index in Scene::bodies
  engine::CommandList commands_;
};

}  // namespace fathom::cli
