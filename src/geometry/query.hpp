// Rays and moving shapes against single shapes. Pure; in double precision, see placed_shape.hpp.
#pragma once

#include <fathom/query.hpp>
#include <optional>

#include "geometry/geometry.hpp"

namespace fathom {

struct PlacedShape;

struct SurfaceHit {
  float fraction = 0;  ///< of the translation, in [0, 1]
  Vec3 point;          ///< m, world
  Vec3 normal;         ///< unit, outward from the shape that is hit, world; zero where the way begins in it or on it
  bool starts_inside = false;            ///< the way begins in the shape or on it
  std::uint32_t triangle = no_triangle;  ///< of a surface
  std::uint32_t child = 0;               ///< of a compound
};

/// Where the ray from `origin` to `origin` + `translation` enters the placed shape. A ray of zero length hits
/// the shapes that hold its origin. Of surfaces it hits the outside alone, up to the fraction `limit`. All arguments
/// must be finite.
std::optional<SurfaceHit> ray_cast(const Geometry& shape, const Pose& pose, Vec3 origin, Vec3 translation,
                                   double limit = 1);

/// Where `moving` first touches `still` on its way along `translation`, which is not zero, as far as the fraction
/// `limit` of it. It stops at most a millionth of the thinner shape's thickness before.
std::optional<SurfaceHit> shape_cast(const PlacedShape& moving, Vec3 translation, const PlacedShape& still,
                                     double limit = 1);

}  // namespace fathom
