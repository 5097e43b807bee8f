// What is drawn over the bodies to show how they are simulated.
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
  bool impulses = false;   ///< normal impulses, as lines whose length tells them
  bool graph = false;      ///< lines between touching bodies, coloured as the constraint graph is
  bool joints = false;     ///< anchors, lines from the bodies' centres to them, axes
  bool reactions = false;  ///< what joints do to their second bodies, as lines
  /// All of it is seen through bodies, which hide it otherwise.
  bool see_through = false;

  friend bool operator==(const OverlayChoice&, const OverlayChoice&) = default;
};

/// Sets what a list like "boxes,points" names. Throws `Error{invalid_argument}` on an unknown word.
OverlayChoice parse_overlays(const std::string& list);

/// Marks for a world, with outlines of its sensors. Bodies hide them, but where `see_through` asks for it all but boxes
/// and sensors.
struct OverlayMarks {
  std::vector<render::Mark> hidden, on_top;
};
void add_overlays(const World& world, const OverlayChoice& choice, OverlayMarks& marks);
/// The spring between a grabbed body and the hand.
void add_grip(const World& world, const Session::Grip& grip, OverlayMarks& marks);

}  // namespace fathom::viewer
