// Joints as marks over a picture.
#pragma once

#include <fathom/world.hpp>
#include <vector>

#include "render/renderer.hpp"

namespace fathom::render {

/// For every joint lines from the bodies' centres to their anchors, the anchors as points, and a line between them,
/// which is seen where they are apart. Bodies that do not move have no line from their centre. Hinges and sliders are
/// lines along their axes, limits of angles rays at their ends, cones a few rays, distances lines.
void add_joint_marks(const World& world, std::vector<Mark>& marks);
/// What every joint does to its body B, at its anchor: half a metre long where it carries the heaviest jointed body's
/// weight.
void add_reaction_marks(const World& world, std::vector<Mark>& marks);

}  // namespace fathom::render
