// How deep bodies are in each other, whichever engine left them so.
#pragma once

#include <span>

#include "scene/scene.hpp"

namespace fathom {

/// The deepest that a dynamic body is in any other one (m), along the axis in which they overlap least; 0 where none
/// overlap. Bodies whose pose is not finite are left out, and pairs that filters or joints keep from touching.
double deepest_overlap(const Scene& scene, std::span<const Pose> poses);

}  // namespace fathom
