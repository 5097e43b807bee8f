// What the window remembers from one time to the next.
#pragma once

#include <string>

#include "render/world_colours.hpp"
#include "viewer/overlays.hpp"

namespace fathom::viewer {

struct Preferences {
  int width = 1280, height = 800;  ///< pixels of the window
  float speed = 1;                 ///< simulated seconds a second
  bool show_panel = true;
  OverlayChoice overlays;
  render::Colouring colouring = render::Colouring::start;

  friend bool operator==(const Preferences&, const Preferences&) = default;
};

/// Where the user's are: in $XDG_CONFIG_HOME or ~/.config; empty where there is neither.
std::string preferences_file();
/// What the file says. What is missing, unreadable or out of range stays as it is by default: nobody wrote it by hand.
Preferences load_preferences(const std::string& path);
/// Makes the folder where it is missing. Throws `Error{file}`.
void save_preferences(const std::string& path, const Preferences& preferences);

}  // namespace fathom::viewer
