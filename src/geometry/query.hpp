// Rays and moving shapes against single shapes. Pure; in double precision, see placed_shape.hpp.
#pragma once

#include <fathom/query.hpp>
#include <optional>

#include "geometry/geometry.hpp"

namespace fathom {

struct PlacedShape;

struct SurfaceHit {
  float fraction = 0;          ///< of the translation, in [0, 1]
  Vec3 point;                  ///< m, world
  Vec3 normal;                 ///< unit, world, outward from the shape hit; zero if the path starts inside or on it
  bool starts_inside = false;  ///< the path starts inside or on the shape
  std::uint32_t triangle = no_triangle;  ///< of a surface
  std::uint32_t child = 0;               ///< of a compound
};

/// Search limit beyond the nearest hit so far: a hit that is equally near up to rounding may have a lower number.
FATHOM_HD float search_limit(double nearest) {
  const double limit = nearest * (1 + 1e-6);
  return limit < 1 ? static_cast<float>(limit) : 1.0f;
}

/// The same among bodies, whose fractions are known in single precision.
FATHOM_HD double limit_beyond(float nearest) {
  const double limit = (1 + 1e-7) * static_cast<double>(nearest);
  return limit < 1 ? limit : 1.0;
}

/// Where the ray from `origin` to `origin` + `translation` enters the placed shape, up to the fraction `limit`. A ray
/// of zero length hits the shapes that contain its origin. A ray hits surfaces only from outside. All arguments must be
/// finite.
std::optional<SurfaceHit> ray_cast(const Geometry& shape, const Pose& pose, const Ray& ray, double limit = 1);

/// Where `moving` first touches `still` when moved along `translation` (not zero), up to the fraction `limit` of it. It
/// stops short of contact by at most a millionth of the thinner shape's thickness.
std::optional<SurfaceHit> shape_cast(const PlacedShape& moving, Vec3 translation, const PlacedShape& still,
                                     double limit = 1);

}  // namespace fathom
