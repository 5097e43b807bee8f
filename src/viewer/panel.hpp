// The panel beside the picture: choices, statistics, scrolling stage times.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "render/stage.hpp"
#include "viewer/overlays.hpp"
#include "viewer/session.hpp"

namespace fathom::viewer {

/// Settings made by panel and keys.
struct ViewState {
  bool paused = false;
  bool single_step = false;  ///< make one step in the next frame
  float speed = 1;           ///< simulated seconds per second
  bool show_panel = true, show_help = false;
  OverlayChoice overlays;
  render::Colouring colouring = render::Colouring::start;
  render::LookKind look = render::LookKind::daylight;
  // Measured by the loop.
  float frame_ms = 0;
  float reached_speed = 1;  ///< simulated seconds per second, over the last second
  std::string message;      ///< the last error, shown until the next choice
};

/// What the user requested in the panel.
struct PanelRequest {
  std::optional<Choice> choice;
  bool reset = false, shoot = false, undo = false;
};

/// Width of the panel at the left (pixels of the display); the scene has the remainder of the window.
float panel_width();

/// Call between `Window::begin_panel` and `Window::draw_panel`.
PanelRequest draw_panel(const Session& session, const std::vector<SimulatorChoice>& simulators, ViewState& state);

}  // namespace fathom::viewer
