// Sensors as outlines in a picture.
#pragma once

#include <fathom/world.hpp>
#include <vector>

#include "render/renderer.hpp"

namespace fathom::render {

/// The edges of every sensor, three circles where it is round, and of surfaces their box; brighter where somebody is in
/// it.
void add_sensor_marks(const World& world, std::vector<Mark>& marks);

}  // namespace fathom::render
