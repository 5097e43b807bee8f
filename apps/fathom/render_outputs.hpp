// The files that `fathom render` writes: pictures, a film, a page.
#pragma once

#include <fathom/world.hpp>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "output.hpp"
#include "render/egl_context.hpp"
#include "render/stage.hpp"
#include "render/video.hpp"
#include "render/web_page.hpp"
#include "render_options.hpp"

namespace fathom::cli {

/// Frames at even distances of simulated time: each at the step nearest to its time, several where steps are long.
class FrameClock {
 public:
  FrameClock(double rate, double seconds) : rate_(rate), seconds_(seconds) {}

  /// How many frames are due at `time` (s), with steps of `dt`.
  int due(double time, double dt);

 private:
  double rate_, seconds_;
  std::uint64_t next_ = 0;
};

class RenderOutputs {
 public:
  /// Opens everything, so that a run is not lost to a wrong path, a missing program or a machine that cannot draw.
  /// `name` starts the pictures' names; `say` is told of each file when it is complete.
  RenderOutputs(const RenderOptions& options, std::string name, std::function<void(const std::string&)> say);

  /// Draws what is due. False where nothing is due after this.
  bool visit(const World& world);
  /// Completes film and page.
  void finish();
  /// Simulated time (s) at which the last thing is due.
  double last() const { return last_; }

 private:
  render::Stage& stage(const World& world);
  void open_stills();
  void write_still(const World& world);

  RenderOptions options_;
  std::string name_;
  std::function<void(const std::string&)> say_;
  std::vector<double> stills_;  // s, latest first
  bool single_ = false;         // the output is one picture's file
  double last_ = 0;
  // In this order: the context outlives what is made in it.
  std::unique_ptr<render::OffscreenContext> context_;
  std::optional<render::Stage> stage_;
  std::optional<render::Video> video_;
  FrameClock film_, page_clock_;
  Output page_file_;
  std::optional<render::WebPage> page_;
};

}  // namespace fathom::cli
