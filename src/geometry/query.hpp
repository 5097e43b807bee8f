// Rays against single shapes.
#pragma once

#include <optional>

#include "geometry/geometry.hpp"

namespace fathom {

struct SurfaceHit {
  float fraction = 0;  ///< of the ray's translation, in [0, 1]
  Vec3 normal;         ///< unit, outward, in the ray's frame; zero where the ray starts in the shape or on it
};

/// Where the ray from `origin` to `origin` + `translation` enters the placed shape. A ray of zero length hits
/// the shapes that hold its origin. All arguments must be finite.
std::optional<SurfaceHit> ray_cast(const Geometry& shape, const Pose& pose, Vec3 origin, Vec3 translation);

}  // namespace fathom
