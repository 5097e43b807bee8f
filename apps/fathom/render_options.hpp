// Options of `fathom render`.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "options.hpp"
#include "render/stage.hpp"

namespace fathom::cli {

inline constexpr double longest_film = 1e6;  // s

struct RenderOptions {
  RunOptions run;  ///< what is simulated
  std::string at;
  std::string output;  ///< for pictures; empty for the default
  std::string video;
  std::string web;
  std::optional<double> seconds;
  std::optional<int> frames_per_second;
  std::string gpu = "auto";
  std::optional<render::LookKind> look;
  render::StageSettings stage;

  /// The times of `--at` (s).
  std::vector<double> times() const;
  double film_seconds() const { return seconds.value_or(10); }
  /// Destination of pictures: a folder, or one picture's file.
  std::string picture_path() const { return output.empty() ? "shots" : output; }
  /// Throws `Error` if an option configures something that is not requested.
  void check() const;
};

void declare_render(CLI::App& command, RenderOptions& options);

}  // namespace fathom::cli
