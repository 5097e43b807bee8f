// How deeply bodies overlap, whichever engine simulated them.
#pragma once

#include <span>

#include "scene/scene.hpp"

namespace fathom {

/// The deepest penetration of any dynamic body into another (m), along the axis of least overlap; 0 if none overlap.
/// Ignores bodies whose pose is not finite, and pairs kept from touching by filters or joints.
double deepest_overlap(const Scene& scene, std::span<const Pose> poses);

}  // namespace fathom
