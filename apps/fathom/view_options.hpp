// Options of `fathom view`.
#pragma once

#include <string>

#include "options.hpp"
#include "picture_options.hpp"
#include "viewer/viewer.hpp"

namespace fathom::cli {

struct ViewOptions {
  RunOptions run;  ///< what is simulated
  std::string overlays;
  viewer::ViewerSettings settings;
};

void declare_view(CLI::App& command, ViewOptions& options);

}  // namespace fathom::cli
