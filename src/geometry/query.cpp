#include "geometry/query.hpp"

#include "geometry/compound_query.hpp"
#include "geometry/ray.hpp"
#include "geometry/surface_query.hpp"

namespace fathom {

std::optional<SurfaceHit> ray_cast(const Geometry& shape, const Pose& pose, const Ray& ray, double limit) {
  if (shape.is_compound()) return ray_cast_at_compound(shape.compound(), pose, ray, limit);
  if (shape.is_surface()) return ray_cast_at_surface(shape, pose, ray, limit);
  SurfaceHit hit;
  return meets_convex(ray, shape, pose, hit) ? std::optional(hit) : std::nullopt;
}

}  // namespace fathom
