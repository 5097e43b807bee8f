// `fathom play`: a scene inside the engine's main loop, headless or in a window.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <utility>

#include "commands.hpp"
#include "engine/engine.hpp"
#include "engine/scene_entities.hpp"
#include "files/claim.hpp"
#include "measure/system.hpp"
#include "setup.hpp"
#ifdef FATHOM_HAS_VIEWER
#include "viewer/engine_window.hpp"
#endif

namespace fathom::cli {
namespace {

std::unique_ptr<engine::FrontEnd> open_window(const engine::Config& config) {
#ifdef FATHOM_HAS_VIEWER
  const auto& window = config->window;
  return std::make_unique<viewer::EngineWindow>(viewer::EngineWindowSettings{
      window.title, window.width, window.height, config->loop.pacing == engine::Pacing::vsync});
#else
  (void)config;
  throw Error(ErrorCode::unavailable,
              "this build has no window; leave window.enabled out, or build where GLFW and OpenGL are installed");
#endif
}

/// From a corner, far enough to see everything that can move.
engine::Camera overview(const Scene& scene) {
  Aabb all{};
  bool any = false;
  for (const BodyDef& body : scene.bodies) {
    if (body.motion == MotionType::fixed) continue;
    const Aabb here{body.pose.position, body.pose.position};
    all = any ? merged(all, here) : here;
    any = true;
  }
  const Vec3 middle = centre(all);
  const float distance = 4 + 1.2f * length(all.upper - all.lower);
  return {.eye = middle + distance * normalize(Vec3{1, -1, 0.6f}), .target = middle};
}

/// Space pauses, a full stop makes one step, escape ends, unless the configuration binds the action otherwise.
void bind_keys(engine::Config& config) {
  for (const auto& [action, key] : {std::pair{"pause", "space"}, {"step", "period"}, {"quit", "escape"}})
    if (!config->actions.contains(action)) config.set(fmt::format("input.actions.{}={}", action, key));
}

using KeyAndFile = std::pair<const char*, std::string>;

std::array<KeyAndFile, 4> outputs_of(const engine::Settings& settings) {
  return {{{"record.file", settings.record.file},
           {"trace.file", settings.trace.file},
           {"log.data", settings.log.data},
           {"log.file", settings.log.file}}};
}

void check_names(const RunOptions& options, const engine::Settings& settings) {
  files::FileNames names = inputs_of(options);
  for (const auto& [key, file] : outputs_of(settings)) names.writes(key, file);
}

}  // namespace

int play(const RunOptions& options) {
  const InterruptGuard interrupt;
  auto [scene, config, size_note] = make_setup(options);
  check_names(options, *config);
  bind_keys(config);
  if (options.quiet && !config.is_set("log.level"))
    config.give("log.level", "--quiet", [](engine::Settings& settings) { settings.log.level = "warning"; });
  // A scene starts with all its bodies, however many an application may add per frame.
  if (config.origin("world.spawns_per_frame") == "default")
    config.edit().world.spawns_per_frame =
        std::max(config->world.spawns_per_frame, static_cast<int>(scene.bodies.size()) + 1);
  const bool windowed = config->window.enabled;
  const std::unique_ptr<engine::FrontEnd> window = windowed ? open_window(config) : nullptr;

  engine::Engine engine(config, window.get());
  engine::spawn_scene(engine, scene);
  engine.camera() = overview(scene);
  engine.input().on_action("pause", [&](bool pressed) {
    if (pressed) engine.set_paused(!engine.paused());
  });
  engine.input().on_action("step", [&](bool pressed) {
    if (pressed) engine.single_step();
  });
  engine.input().on_action("quit", [&](bool pressed) {
    if (pressed) engine.stop();
  });
  engine.end_when([] { return InterruptGuard::requested(); });
  // A window stays open until it is closed.
  const bool endless = windowed && !options.steps && !options.seconds;
  engine.run(endless ? 0 : steps_to_run(options, scene.world));
  std::uint64_t hash = 0;
  engine.simulation().inspect([&](const engine::CommandRunner& runner) { hash = runner.world().state_hash(); });
  const std::string summary = fmt::format(
      "{}{}: {} frames, {} steps, {:.2f} s simulated, {} entities\n  state hash             {:016x}\n", scene.name,
      size_note, engine.stats().frame, engine.steps(), engine.time(), engine.world().count(), hash);
  // A file on stdout must be the only output there.
  if (!options.quiet && std::ranges::any_of(outputs_of(*config), files::is_stdout, &KeyAndFile::second))
    tell(summary);
  else if (!options.quiet)
    fmt::print("{}", summary);
  engine.finish();
  return InterruptGuard::requested() ? interrupted : finished;
}

}  // namespace fathom::cli
