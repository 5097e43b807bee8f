// Overlays over the bodies that show how they are simulated.
#pragma once

#include <fathom/world.hpp>
#include <string>
#include <vector>

#include "render/renderer.hpp"
#include "viewer/session.hpp"

namespace fathom::viewer {

struct OverlayChoice {
  bool boxes = false;      ///< AABBs
  bool points = false;     ///< contact points
  bool normals = false;    ///< contact normals
  bool impulses = false;   ///< normal impulses, as lines of proportional length
  bool graph = false;      ///< lines between touching bodies, in the colours of the constraint graph
  bool joints = false;     ///< anchors, lines from the bodies' centres to them, axes
  bool reactions = false;  ///< reactions of joints on their second bodies, as lines
  /// Overlays are visible through bodies, which otherwise hide them.
  bool see_through = false;

  friend bool operator==(const OverlayChoice&, const OverlayChoice&) = default;
};

/// Parses a list like "boxes,points". Throws `Error{invalid_argument}` for an unknown word.
OverlayChoice parse_overlays(const std::string& list);

/// Marks for a world, with outlines of its sensors. Bodies hide them; with `see_through`, only sensors are hidden.
struct OverlayMarks {
  std::vector<render::Mark> hidden, on_top;
};
void add_overlays(const World& world, const OverlayChoice& choice, OverlayMarks& marks);
/// The spring between a grabbed body and the grip's target.
void add_grip(const World& world, const Session::Grip& grip, OverlayMarks& marks);

}  // namespace fathom::viewer
