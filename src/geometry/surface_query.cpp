#include "geometry/surface_query.hpp"

#include <fathom/mesh.hpp>
#include <limits>
#include <vector>

#include "check/check.hpp"
#include "geometry/local_box.hpp"
#include "geometry/ray.hpp"

namespace fathom {
namespace {

/// One triangle of a placed surface as a separate shape. Refers to the triangle's corners, which must outlive it.
PlacedShape placed(const PlacedShape& surface, const Triangle& triangle, double thinnest) {
  PlacedShape shape = surface;
  shape.hull.vertices = triangle.corners;
  shape.hull.vertex_count = 3;
  shape.radius = 0;
  shape.thinnest = thinnest;  // that of the other shape
  return shape;
}

struct Corners {
  Vec3d a, b, c;

  Corners(const Triangle& t, Vec3d origin)
      : a(to_double(t.corners[0]) - origin), b(to_double(t.corners[1]) - origin), c(to_double(t.corners[2]) - origin) {}
  /// Outward; its length is twice the triangle's area.
  Vec3d normal() const { return cross(b - a, c - a); }
};

/// Calls act(number, triangle) for the surface's triangles along the path; act returns the fraction at which to stop.
template <class Act>
void for_each_along(const Surface& surface, Vec3d centre, Vec3d half, Vec3d way, const Act& act) {
  struct Visitor final : TriangleVisitor {
    Visitor(const Surface& of, const Act& how) : surface(of), act(how) {}
    float visit(std::uint32_t triangle) override { return act(triangle, surface.triangle(triangle)); }
    const Surface& surface;
    const Act& act;
  } visitor(surface, act);
  surface.find_along(to_float(centre), to_float(half), to_float(way), visitor);
}

}  // namespace

std::optional<SurfaceHit> ray_cast_at_surface(const Geometry& surface, const Pose& pose, const Ray& ray, double limit) {
  SurfaceRay of_surface(ray, surface, pose, limit);
  const LocalRay& local = of_surface.local();
  for_each_along(surface.surface(), local.origin, {}, local.translation,
                 [&](std::uint32_t number, const Triangle& triangle) { return of_surface.meet(number, triangle); });
  SurfaceHit hit;
  return of_surface.hit(hit) ? std::optional(hit) : std::nullopt;
}

std::optional<SurfaceHit> shape_cast_at_surface(const PlacedShape& moving, Vec3 translation, const Geometry& surface,
                                                const Pose& pose, double limit) {
  const PlacedShape frame(surface, pose);
  const LocalBox box(frame, moving);
  const Vec3d way = frame.to_local(to_double(translation));
  std::optional<SurfaceHit> nearest;
  for_each_along(surface.surface(), box.centre, box.half, way, [&](std::uint32_t number, const Triangle& triangle) {
    const double end = nearest ? static_cast<double>(nearest->fraction) : limit;
    const PlacedShape still = placed(frame, triangle, moving.thinnest);
    const bool leaves = dot(Corners(triangle, {}).normal(), way) > 0;
    std::optional<SurfaceHit> hit;
    if (!leaves)
      hit = shape_cast(moving, translation, still, static_cast<double>(search_limit(end)));
    else if (const Separation s = separation(still, moving); s.touch())
      hit = SurfaceHit{0, to_float(still.position + s.on_a), {}, true};
    if (hit && (!nearest || hit->fraction < nearest->fraction ||
                (hit->fraction == nearest->fraction && number < nearest->triangle))) {
      nearest = hit;
      nearest->triangle = number;
    }
    return search_limit(nearest ? static_cast<double>(nearest->fraction) : limit);
  });
  return nearest;
}

bool touches_surface(const PlacedShape& shape, const Geometry& surface, const Pose& pose) {
  const PlacedShape frame(surface, pose);
  std::vector<std::uint32_t> found;
  surface.surface().find(LocalBox(frame, shape).grown(0), found);
  return std::ranges::any_of(found, [&](std::uint32_t number) {
    const Triangle triangle = surface.surface().triangle(number);
    return separation(placed(frame, triangle, shape.thinnest), shape).touch();
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
      const Separation s = separation(placed(frame, triangle, shape.thinnest), shape);
      if (s.distance < nearest.distance) nearest = s;
    }
    if (nearest.distance <= reach || reach > all) break;
  }
  FATHOM_ASSERT(std::isfinite(nearest.distance));
  return nearest;
}

}  // namespace fathom
