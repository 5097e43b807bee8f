// Sensors as outlines in a picture.
#pragma once

#include <fathom/world.hpp>
#include <vector>

#include "render/renderer.hpp"

namespace fathom::render {

/// The edges of every sensor, three circles for round ones, the box for surfaces; brighter while a body is inside.
void add_sensor_marks(const World& world, std::vector<Mark>& marks);

}  // namespace fathom::render
