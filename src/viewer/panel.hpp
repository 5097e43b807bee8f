// The panel beside the picture: choices, figures, stage times as they scroll by.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "render/stage.hpp"
#include "viewer/overlays.hpp"
#include "viewer/session.hpp"

namespace fathom::viewer {

/// What is set by panel and keys.
struct ViewState {
  bool paused = false;
  bool single_step = false;  ///< make one step in the next frame
  float speed = 1;           ///< simulated seconds a second
  bool show_panel = true, show_help = false;
  OverlayChoice overlays;
  render::Colouring colouring = render::Colouring::start;
  render::LookKind look = render::LookKind::daylight;
  // Measured by the loop.
  float frame_ms = 0;
  float reached_speed = 1;  ///< simulated seconds a second over the last second
  std::string message;      ///< the last error, shown until the next choice
};

/// What the panel asks for.
struct PanelRequest {
  std::optional<Choice> choice;
  bool reset = false, shoot = false, undo = false;
};

/// How wide the panel is (pixels of the display), which stands at the left; the scene has the rest of the window.
float panel_width();

/// Must be called between `Window::begin_panel` and `Window::draw_panel`.
PanelRequest draw_panel(const Session& session, const std::vector<SimulatorChoice>& simulators, ViewState& state);

}  // namespace fathom::viewer
