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

/// Frames at equal intervals of simulated time: each at the step nearest to its time, several at once if steps are
/// long.
class FrameClock {
 public:
  FrameClock(double rate, double seconds) : rate_(rate), seconds_(seconds) {}

  /// Number of frames due at `time` (s), with steps of `dt`.
  int due(double time, double dt);

 private:
  double rate_, seconds_;
  std::uint64_t next_ = 0;
};

class RenderOutputs {
 public:
  /// Opens everything, so that a wrong path, a missing program or a machine that cannot draw does not cost a run.
  /// `name` is the prefix of the pictures' names; `say` is told of each file when it is complete.
  RenderOutputs(const RenderOptions& options, std::string name, std::function<void(const std::string&)> say);

  /// Draws what is due. False if nothing is due later.
  bool visit(const World& world);
  /// Completes film and page.
  void finish();
  /// Simulated time (s) of the last output.
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
  // In this order: the context outlives objects created in it.
  std::unique_ptr<render::OffscreenContext> context_;
  std::optional<render::Stage> stage_;
  std::optional<render::Video> video_;
  FrameClock film_, page_clock_;
  Output page_file_;
  std::optional<render::WebPage> page_;
};

}  // namespace fathom::cli
