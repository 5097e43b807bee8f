#include "geometry/surface_query.hpp"

#include <fathom/mesh.hpp>
#include <limits>
#include <vector>

#include "check/check.hpp"
#include "geometry/ray.hpp"
#include "geometry/surface_cast.hpp"

namespace fathom {
namespace {

/// Calls act(number, triangle) for the surface's triangles along the path; act returns the fraction at which to stop.
template <class Act>
void for_each_along(const Surface& surface, Vec3 centre, Vec3 half, Vec3 way, const Act& act) {
  struct Visitor final : TriangleVisitor {
    Visitor(const Surface& of, const Act& how) : surface(of), act(how) {}
    float visit(std::uint32_t triangle) override { return act(triangle, surface.triangle(triangle)); }
    const Surface& surface;
    const Act& act;
  } visitor(surface, act);
  surface.find_along(centre, half, way, visitor);
}

}  // namespace

std::optional<SurfaceHit> ray_cast_at_surface(const Geometry& surface, const Pose& pose, const Ray& ray, double limit) {
  SurfaceRay of_surface(ray, surface, pose, limit);
  const LocalRay& local = of_surface.local();
  for_each_along(surface.surface(), to_float(local.origin), {}, to_float(local.translation),
                 [&](std::uint32_t number, const Triangle& triangle) { return of_surface.meet(number, triangle); });
  SurfaceHit hit;
  return of_surface.hit(hit) ? std::optional(hit) : std::nullopt;
}

std::optional<SurfaceHit> shape_cast_at_surface(const PlacedShape& moving, Vec3 translation, const Geometry& surface,
                                                const Pose& pose, double limit) {
  SurfaceCast cast(moving, translation, surface, pose, limit);
  for_each_along(surface.surface(), cast.centre(), cast.half(), cast.way(),
                 [&](std::uint32_t number, const Triangle& triangle) { return cast.meet(number, triangle); });
  SurfaceHit hit;
  return cast.hit(hit) ? std::optional(hit) : std::nullopt;
}

bool touches_surface(const PlacedShape& shape, const Geometry& surface, const Pose& pose) {
  const PlacedShape frame(surface, pose);
  std::vector<std::uint32_t> found;
  surface.surface().find(LocalBox(frame, shape).grown(0), found);
  return std::ranges::any_of(found, [&](std::uint32_t number) {
    const Triangle triangle = surface.surface().triangle(number);
    return separation(placed_triangle(frame, triangle, shape.thinnest), shape).touch();
  });
}

// Searches boxes of doubling size around the shape until one contains the nearest triangle.
Separation separation_from_surface(const Geometry& surface, const Pose& pose, const PlacedShape& shape) {
  const PlacedShape frame(surface, pose);
  const LocalBox box(frame, shape);
  const Aabb bounds = surface.surface().bounds();
  const Vec3d low = to_double(bounds.lower), high = to_double(bounds.upper);
  const auto farthest = [](double c, double lower, double upper) {
    return std::max(std::abs(lower - c), std::abs(upper - c));
  };
  const double all = length(Vec3d{farthest(box.centre.x, low.x, high.x), farthest(box.centre.y, low.y, high.y),
                                  farthest(box.centre.z, low.z, high.z)});
  Separation nearest;
  nearest.distance = std::numeric_limits<double>::infinity();
  std::vector<std::uint32_t> found;
  for (double reach = std::max(length(box.half), 1e-3 * length(high - low));; reach *= 2) {
    found.clear();
    surface.surface().find(box.grown(reach), found);
    for (const std::uint32_t number : found) {
      const Triangle triangle = surface.surface().triangle(number);
      const Separation s = separation(placed_triangle(frame, triangle, shape.thinnest), shape);
      if (s.distance < nearest.distance) nearest = s;
    }
    if (nearest.distance <= reach || reach > all) break;
  }
  FATHOM_ASSERT(std::isfinite(nearest.distance));
  return nearest;
}

}  // namespace fathom
