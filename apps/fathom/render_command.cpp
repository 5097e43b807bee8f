// `fathom render`: pictures, films and web pages of a run or a recording, without a window.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "commands.hpp"
#include "engine/recording.hpp"
#include "measure/system.hpp"
#include "progress.hpp"
#include "render_outputs.hpp"
#include "setup.hpp"

namespace fathom::cli {
namespace {

namespace fs = std::filesystem;

void say(const RenderOptions& options, const std::string& written) {
  if (!options.run.quiet) fmt::print("{}\n", written);
}

int render_run(const RenderOptions& options) {
  const InterruptGuard interrupt;
  const Scene scene = make_scene(options.run);
  RenderOutputs outputs(options, scene.name, [&](const std::string& path) { say(options, path); });
  World world(scene.world);
  SceneInstance instance(scene, world);
  const auto steps = static_cast<std::uint64_t>(std::ceil(outputs.last() / static_cast<double>(scene.world.dt)));
  Progress progress(steps + 1, !options.run.quiet && stderr_is_terminal());
  while (outputs.visit(world) && !InterruptGuard::requested()) {
    instance.prepare_step();
    world.step();
    world.wait();
    progress.update(world.step_count());
  }
  outputs.finish();
  return InterruptGuard::requested() ? interrupted : finished;
}

/// The latest time (s) that the command line names.
double latest_asked(const RenderOptions& options) {
  double latest = options.seconds && !(options.video.empty() && options.web.empty()) ? *options.seconds : 0;
  for (const double time : options.times()) latest = std::max(latest, time);
  return latest;
}

/// Thrown through a replay when the last picture is drawn.
struct Enough {};

int render_recording(RenderOptions options) {
  if (options.run.decides_states()) {
    throw Error(ErrorCode::invalid_argument,
                options.run.scene +
                    " is a recording, which says itself what was simulated; leave the options of the scene out");
  }
  const double asked = latest_asked(options);
  // To the end, unless specified otherwise.
  if (!options.seconds) options.seconds = longest_film;
  const InterruptGuard interrupt;
  RenderOutputs outputs(options, fs::path(options.run.scene).stem().string(),
                        [&](const std::string& path) { say(options, path); });
  engine::ReplaySettings settings;
  settings.threads = options.run.simulator.threads.value_or(0);
  settings.check_snapshots = false;
  double end = 0, half_step = 0;  // s
  const auto visit = [&](const World& world) {
    end = world.time(), half_step = 0.5 * static_cast<double>(world.definition().dt);
    if (!outputs.visit(world) || InterruptGuard::requested()) throw Enough{};
  };
  settings.before_first_step = visit;
  settings.after_step = [&](std::uint64_t, const World& world) { visit(world); };
  std::string difference;
  try {
    const engine::ReplayResult result = engine::replay(options.run.scene, settings);
    if (result.difference) difference = result.difference->text();
  } catch (const Enough&) {
  }
  outputs.finish();
  if (!difference.empty()) {
    tell(fmt::format("fathom: the replay differs from the recording: {}; was it recorded by another version?\n",
                     difference));
    return failed;
  }
  if (InterruptGuard::requested()) return interrupted;
  if (asked > end + half_step)
    throw Error(ErrorCode::invalid_argument,
                fmt::format("{} ends at {:.5g} s, but times up to {:.5g} s were asked for; ask for earlier ones",
                            options.run.scene, end, asked));
  return finished;
}

}  // namespace

int render(const RenderOptions& options) {
  options.check();
  files::FileNames names = inputs_of(options.run);
  names.writes("--video", options.video);
  names.writes("--web", options.web);
  // Ignored if it is a folder of pictures.
  names.writes("-o", options.output);
  return is_recording(options.run.scene) ? render_recording(options) : render_run(options);
}

}  // namespace fathom::cli
