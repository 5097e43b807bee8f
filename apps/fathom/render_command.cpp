// `fathom render`: pictures, films and web pages of a run, without a window.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

#include "commands.hpp"
#include "progress.hpp"
#include "render/egl_context.hpp"
#include "render/stage.hpp"
#include "render/video.hpp"
#include "render/web_page.hpp"
#include "render_options.hpp"
#include "setup.hpp"
#include "system.hpp"

namespace fathom::cli {
namespace {

using namespace fathom::render;
namespace fs = std::filesystem;

/// When there is something to draw.
class Schedule {
 public:
  Schedule(const RenderOptions& options, double dt) : dt_(dt) {
    for (const double time : options.times()) stills_.push_back(step_at(time));
    std::sort(stills_.begin(), stills_.end());
    stills_.erase(std::unique(stills_.begin(), stills_.end()), stills_.end());
    if (stills_.empty() && options.video.empty() && options.web.empty()) {
      throw Error(
          ErrorCode::invalid_argument,
          "nothing to draw; ask for pictures (--at 0,5,10s), a film (--video FILE.mp4) or a page (--web FILE.html)");
    }
    last_ = stills_.empty() ? 0 : stills_.back();
    if (!options.video.empty() || !options.web.empty()) last_ = std::max(last_, step_at(options.film_seconds()));
  }

  bool is_still(std::uint64_t step) const { return std::binary_search(stills_.begin(), stills_.end(), step); }
  std::size_t stills() const { return stills_.size(); }
  std::uint64_t last() const { return last_; }

 private:
  std::uint64_t step_at(double time) const { return static_cast<std::uint64_t>(std::llround(time / dt_)); }

  double dt_;
  std::vector<std::uint64_t> stills_;
  std::uint64_t last_ = 0;
};

/// The frames of a film: each at the step nearest to its time, several at one step where steps are long.
class FilmClock {
 public:
  FilmClock(double rate, double seconds, double dt)
      : rate_(rate), count_(static_cast<std::uint64_t>(std::floor(seconds * rate + 1e-6)) + 1), dt_(dt) {}

  /// How many frames are due after this step.
  int due(std::uint64_t step) {
    int frames = 0;
    while (next_ < count_ && static_cast<double>(next_) / rate_ < (static_cast<double>(step) + 0.5) * dt_)
      ++next_, ++frames;
    return frames;
  }

 private:
  double rate_;
  std::uint64_t next_ = 0, count_;
  double dt_;
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

/// The page, opened before the run, so that a run is not lost to a wrong path.
class WebFile {
 public:
  WebFile(const RenderOptions& options, const std::string& name, double dt)
      : path_(options.web),
        file_(path_, std::ios::binary),
        // A page interpolates, so a frame for every step is more than it needs.
        every_(std::max<std::uint64_t>(
            1, static_cast<std::uint64_t>(std::llround(1 / (dt * options.frames_per_second.value_or(30)))))),
        page_(name, 1 / (dt * static_cast<double>(every_))) {
    if (!file_) throw Error(ErrorCode::file, path_ + ": cannot be written; check the folder and its permissions");
  }

  void add(const World& world, std::uint64_t step) {
    if (step % every_ == 0) page_.add(world);
  }

  void finish(const StageSettings& stage) {
    file_ << page_.html(stage.look == LookKind::water, stage.azimuth, stage.elevation) << std::flush;
    if (!file_) throw Error(ErrorCode::file, path_ + ": could not be written to its end; is the disk full?");
  }

 private:
  std::string path_;
  std::ofstream file_;
  std::uint64_t every_;
  WebPage page_;
};

}  // namespace

int render(const RenderOptions& options) {
  const Scene scene = make_scene(options.run);
  const auto dt = static_cast<double>(scene.world.dt);
  const Schedule schedule(options, dt);
  // A page alone is drawn by the browser.
  std::unique_ptr<OffscreenContext> context;
  std::optional<Stage> stage;
  if (schedule.stills() > 0 || !options.video.empty()) {
    context = make_offscreen_context(parse_gpu(options.gpu));
    stage.emplace(stage_settings(options, scene));
  }
  const Stills stills(options.output, scene.name, schedule.stills());
  std::optional<Video> video;
  if (!options.video.empty()) {
    video.emplace(options.video, options.stage.width, options.stage.height, options.frames_per_second.value_or(60));
  }

  FilmClock film(options.frames_per_second.value_or(60), options.film_seconds(), dt);
  std::optional<WebFile> web;
  if (!options.web.empty()) web.emplace(options, scene.name, dt);

  const InterruptGuard interrupt;
  World world(scene.world);
  SceneInstance instance(scene, world);
  Progress progress(schedule.last() + 1, !options.run.quiet && stderr_is_terminal());
  const auto say = [&](const std::string& written) {
    if (!options.run.quiet) fmt::print("{}\n", written);
  };
  for (std::uint64_t step = 0;; ++step) {
    if (schedule.is_still(step)) say(stills.write(stage->draw(world), world.time()));
    for (int i = video ? film.due(step) : 0; i > 0; --i) video->add(stage->draw(world, true));
    if (web) web->add(world, step);
    progress.update(step);
    if (step == schedule.last() || InterruptGuard::requested()) break;
    instance.prepare_step();
    world.step();
  }
  if (video) {
    video->finish();
    say(options.video);
  }
  if (web) {
    web->finish(stage_settings(options, scene));
    say(options.web);
  }
  return InterruptGuard::requested() ? interrupted : finished;
}

}  // namespace fathom::cli
