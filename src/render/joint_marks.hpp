// Joints as marks over a picture.
#pragma once

#include <fathom/world.hpp>
#include <vector>

#include "render/renderer.hpp"

namespace fathom::render {

/// For every joint: lines from the bodies' centres to their anchors (none from bodies that do not move), the anchors as
/// points, and a line between them, visible where they are apart. Hinges and sliders are lines along their axes, angle
/// limits are rays at their ends, cones are a few rays, distances are lines.
void add_joint_marks(const World& world, std::vector<Mark>& marks);
/// The reaction of every joint on its body B, drawn at its anchor: half a metre long for the weight of the heaviest
/// jointed body.
void add_reaction_marks(const World& world, std::vector<Mark>& marks);

}  // namespace fathom::render
