// `fathom render`: pictures, films and web pages of a run, without a window.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include "commands.hpp"
#include "progress.hpp"
#include "render/egl_context.hpp"
#include "render/stage.hpp"
#include "render/video.hpp"
#include "render_options.hpp"
#include "setup.hpp"
#include "system.hpp"

namespace fathom::cli {
namespace {

using namespace fathom::render;
namespace fs = std::filesystem;

/// The steps after which there is something to draw, in ascending order; they repeat where two outputs want one.
class Schedule {
 public:
  Schedule(const RenderOptions& options, double dt) {
    for (const double time : options.times()) stills_.push_back(step_at(time, dt));
    std::sort(stills_.begin(), stills_.end());
    stills_.erase(std::unique(stills_.begin(), stills_.end()), stills_.end());
    last_ = stills_.empty() ? 0 : stills_.back();
    if (!options.video.empty()) last_ = std::max(last_, step_at(options.film_seconds(), dt));
  }

  static std::uint64_t step_at(double time, double dt) { return static_cast<std::uint64_t>(std::llround(time / dt)); }

  bool is_still(std::uint64_t step) const { return std::binary_search(stills_.begin(), stills_.end(), step); }
  std::size_t stills() const { return stills_.size(); }
  std::uint64_t last() const { return last_; }

 private:
  std::vector<std::uint64_t> stills_;
  std::uint64_t last_ = 0;
};

/// The files of single pictures.
class Stills {
 public:
  Stills(const std::string& where, std::string name, std::size_t count) : where_(where), name_(std::move(name)) {
    if (count == 0) return;
    single_ = where_.extension() == ".png";
    if (single_ && count > 1) {
      throw Error(ErrorCode::invalid_argument, "-o " + where + " is one picture, but --at asks for " +
                                                   std::to_string(count) + "; give -o a folder, as in -o shots/");
    }
    std::error_code failure;
    const fs::path folder = single_ ? where_.parent_path() : where_;
    if (!folder.empty()) fs::create_directories(folder, failure);
    if (failure || (!folder.empty() && !fs::is_directory(folder))) {
      throw Error(ErrorCode::file, folder.string() + ": the folder cannot be made; check its name and permissions");
    }
  }

  std::string write(const Image& image, double time) const {
    const std::string path =
        single_ ? where_.string() : (where_ / fmt::format("{}-{:06.2f}s.png", name_, time)).string();
    write_png(image, path);
    return path;
  }

 private:
  fs::path where_;
  std::string name_;
  bool single_ = false;
};

StageSettings stage_settings(const RenderOptions& options, const Scene& scene) {
  StageSettings settings = options.stage;
  // What drifts without gravity drifts in water.
  const bool weightless = length_squared(scene.world.gravity) == 0;
  settings.look = options.look.value_or(weightless ? LookKind::water : LookKind::daylight);
  return settings;
}

}  // namespace

int render(const RenderOptions& options) {
  const Scene scene = make_scene(options.run);
  const auto dt = static_cast<double>(scene.world.dt);
  const Schedule schedule(options, dt);
  const auto context = make_offscreen_context(parse_gpu(options.gpu));
  Stage stage(stage_settings(options, scene));
  const Stills stills(options.output, scene.name, schedule.stills());
  std::optional<Video> video;
  if (!options.video.empty()) {
    video.emplace(options.video, options.stage.width, options.stage.height, options.frames_per_second);
  }

  const InterruptGuard interrupt;
  World world(scene.world);
  SceneInstance instance(scene, world);
  Progress progress(schedule.last() + 1, !options.run.quiet && stderr_is_terminal());
  std::uint64_t film_frames = 0;
  for (std::uint64_t step = 0;; ++step) {
    if (schedule.is_still(step)) {
      const std::string path = stills.write(stage.draw(world), world.time());
      if (!options.run.quiet) fmt::print("{}\n", path);
    }
    // A film may have several frames a step, or several steps a frame.
    while (video && world.time() <= options.film_seconds() + 1e-9 &&
           static_cast<double>(film_frames) / options.frames_per_second <= world.time() + 0.5 * dt) {
      video->add(stage.draw(world, true));
      ++film_frames;
    }
    progress.update(step);
    if (step == schedule.last() || InterruptGuard::requested()) break;
    instance.prepare_step();
    world.step();
  }
  if (video) {
    video->finish();
    if (!options.run.quiet) fmt::print("{}\n", options.video);
  }
  return InterruptGuard::requested() ? interrupted : finished;
}

}  // namespace fathom::cli
