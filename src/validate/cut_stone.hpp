// Stones cut by planes, in double precision, so that neighbours sharing a plane match up to the rounding of their
// poses.
#pragma once

#include <fathom/body.hpp>
#include <vector>

#include "math/vec3d.hpp"

namespace fathom::validate {

/// The half-space dot(normal, p) ≤ offset.
struct Plane {
  Vec3d normal;
  double offset = 0;

  static Plane through(Vec3d point, Vec3d normal) { return {normal, dot(normal, point)}; }
  Plane opposite() const { return {-1.0 * normal, -offset}; }
};

/// The corners of the intersection of all half-spaces, which must be bounded.
std::vector<Vec3d> corners_of(const std::vector<Plane>& planes);

/// A dynamic body of default density: the convex hull of `corners`, placed where they are. `inside` is a point near
/// them: building the hull relative to it loses few digits.
BodyDef stone_of(const std::vector<Vec3d>& corners, Vec3d inside, const Material& material);

}  // namespace fathom::validate
