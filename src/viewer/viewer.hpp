// The program's window.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "render/look.hpp"
#include "render/world_colours.hpp"
#include "viewer/overlays.hpp"
#include "viewer/session.hpp"

namespace fathom::viewer {

struct ViewerSettings {
  int width = 1280, height = 800;
  std::vector<SimulatorChoice> simulators;
  OverlayChoice overlays;
  render::Colouring colouring = render::Colouring::start;
  std::optional<render::LookKind> look;  ///< absent: water if there is no gravity
  float speed = 1;                       ///< simulated seconds per second
  bool panel = true;                     ///< shown at the start
  std::string preferences{};             ///< file for the settings when the window is closed; empty for none
  bool paused = false;
  bool help = false;
  /// Ends after this many frames, of one step each; 0: when the window is closed.
  std::uint64_t frames = 0;
  std::function<bool()> ended;  ///< called every frame; true ends the view like closing the window
  std::string screenshot;       ///< PNG of the last frame, with the panel
};

/// The simulation at the end.
struct ViewResult {
  std::string scene;
  std::uint64_t steps = 0;
  double time = 0;  ///< s, simulated
  std::uint64_t state_hash = 0;
  std::string warning;  ///< what could not be saved for the next run, and why
};

/// Returns when the window is closed, after `frames` frames, or when `ended` returns true. Throws `Error{unavailable}`
/// without a display or OpenGL 4.5, and what `make` throws for the first choice.
ViewResult view(const SceneMaker& make, const Choice& choice, const ViewerSettings& settings);

}  // namespace fathom::viewer
