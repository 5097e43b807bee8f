// Window settings that persist between runs.
#pragma once

#include <optional>
#include <string>

#include "render/look.hpp"
#include "render/world_colours.hpp"
#include "viewer/overlays.hpp"

namespace fathom::viewer {

struct Preferences {
  int width = 1280, height = 800;  ///< pixels of the window
  float speed = 1;                 ///< simulated seconds per second
  bool show_panel = true;
  OverlayChoice overlays;
  render::Colouring colouring = render::Colouring::start;
  std::optional<render::LookKind> look;  ///< absent: the scene's own

  friend bool operator==(const Preferences&, const Preferences&) = default;
};

/// Path of the user's preferences, in $XDG_CONFIG_HOME or ~/.config; empty if there is neither.
std::string preferences_file();
/// Reads the preferences. Missing, unreadable or out-of-range values silently keep their defaults: nobody edits the
/// file by hand.
Preferences load_preferences(const std::string& path);
/// Creates the folder if it is missing. Throws `Error{file}`.
void save_preferences(const std::string& path, const Preferences& preferences);

}  // namespace fathom::viewer
