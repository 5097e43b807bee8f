// How deep bodies are in each other, whichever engine left them so.
#pragma once

#include <span>

#include "fathom/body.hpp"

namespace fathom {

/// The deepest that a dynamic body is in any other one (m), along the axis in which they overlap least; 0 where none
/// overlap. Bodies whose pose is not finite are left out.
double deepest_overlap(std::span<const BodyDef> bodies, std::span<const Pose> poses);

}  // namespace fathom
