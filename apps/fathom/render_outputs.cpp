#include "render_outputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace fathom::cli {
namespace {

using namespace fathom::render;
namespace fs = std::filesystem;

constexpr int film_rate = 60, page_rate = 30;  // frames per second; a page interpolates

render::LookKind look_of(const RenderOptions& options, const World& world) {
  // Scenes without gravity are shown under water.
  return options.look.value_or(length_squared(world.gravity()) == 0 ? LookKind::water : LookKind::daylight);
}

/// "000.50": two decimals, and more if two cannot distinguish times.
std::string time_in_name(double time) {
  std::string text;
  for (int decimals = 2; decimals < 18; ++decimals) {
    text = fmt::format("{:0{}.{}f}", time, decimals + 4, decimals);
    if (std::stod(text) == time) break;
  }
  return text;
}

}  // namespace

int FrameClock::due(double time, double dt) {
  int frames = 0;
  while (static_cast<double>(next_) / rate_ <= seconds_ + 1e-9 && static_cast<double>(next_) / rate_ < time + 0.5 * dt)
    ++next_, ++frames;
  return frames;
}

RenderOutputs::RenderOutputs(const RenderOptions& options, std::string name,
                             std::function<void(const std::string&)> say)
    : options_(options),
      name_(std::move(name)),
      say_(std::move(say)),
      stills_(options.times()),
      film_(options.frames_per_second.value_or(film_rate), options.film_seconds()),
      page_clock_(options.frames_per_second.value_or(page_rate), options.film_seconds()),
      page_file_(options.web) {
  std::sort(stills_.rbegin(), stills_.rend());
  stills_.erase(std::unique(stills_.begin(), stills_.end()), stills_.end());
  const bool films = !options.video.empty() || !options.web.empty();
  last_ = stills_.empty() ? 0 : stills_.front();
  if (films) last_ = std::max(last_, options.film_seconds());
  // A page alone needs no context: the browser draws it.
  const render::GpuChoice gpu = parse_gpu(options.gpu);
  if (!stills_.empty() || !options.video.empty()) context_ = make_offscreen_context(gpu);
  if (!stills_.empty()) open_stills();
  if (!options.video.empty()) {
    video_.emplace(options.video, options.stage.width, options.stage.height,
                   options.frames_per_second.value_or(film_rate));
  }
  if (page_file_.wanted()) page_.emplace(name_, options.frames_per_second.value_or(page_rate));
}

void RenderOutputs::open_stills() {
  const fs::path where = options_.picture_path();
  single_ = where.extension() == ".png";
  if (single_ && stills_.size() > 1) {
    throw Error(ErrorCode::invalid_argument, "-o " + options_.picture_path() + " is one picture, but --at asks for " +
                                                 std::to_string(stills_.size()) +
                                                 "; give -o a folder, as in -o shots/");
  }
  const fs::path folder = single_ ? where.parent_path() : where;
  std::error_code failure;
  if (!folder.empty()) fs::create_directories(folder, failure);
  if (failure || (!folder.empty() && !fs::is_directory(folder))) {
    throw Error(ErrorCode::file, folder.string() + ": the folder cannot be created; check its name and permissions");
  }
}

Stage& RenderOutputs::stage(const World& world) {
  if (!stage_) {
    StageSettings settings = options_.stage;
    settings.look = look_of(options_, world);
    stage_.emplace(settings);
  }
  return *stage_;
}

void RenderOutputs::write_still(const World& world) {
  const fs::path where = options_.picture_path();
  const std::string path =
      single_ ? where.string() : (where / fmt::format("{}-{}s.png", name_, time_in_name(stills_.back()))).string();
  write_png(stage(world).draw(world), path);
  stills_.pop_back();
  say_(path);
}

bool RenderOutputs::visit(const World& world) {
  const auto dt = static_cast<double>(world.definition().dt);
  const double now = world.time() + 0.5 * dt;
  while (!stills_.empty() && stills_.back() < now) write_still(world);
  for (int i = video_ ? film_.due(world.time(), dt) : 0; i > 0; --i) video_->add(stage(world).draw(world, true));
  for (int i = page_ ? page_clock_.due(world.time(), dt) : 0; i > 0; --i) page_->add(world);
  if (page_) options_.look = look_of(options_, world);
  return now <= last_;
}

void RenderOutputs::finish() {
  if (video_) {
    video_->finish();
    say_(options_.video);
  }
  if (page_) {
    page_file_.stream() << page_->html(options_.look == LookKind::water, options_.stage.azimuth,
                                       options_.stage.elevation);
    page_file_.finish();
    if (!page_file_.is_stdout()) say_(options_.web);
  }
}

}  // namespace fathom::cli
