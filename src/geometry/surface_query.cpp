#include "geometry/surface_query.hpp"

#include <fathom/mesh.hpp>
#include <limits>
#include <vector>

#include "check/check.hpp"
#include "geometry/local_box.hpp"

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

// The edge tests have bit-identical signs for the triangles on both sides of an edge: no ray passes between them (S.
// Woop, C. Benthin, I. Wald, "Watertight Ray/Triangle Intersection", JCGT 2 (2013)).
std::optional<SurfaceHit> ray_cast_at_surface(const Geometry& surface, const Pose& pose, Vec3 origin, Vec3 translation,
                                              double limit) {
  const PlacedShape frame(surface, pose);
  const Vec3d from = to_double(origin), way = to_double(translation);
  const Vec3d local_origin = frame.to_local(from - frame.position), local_way = frame.to_local(way);
  double nearest = limit;
  std::uint32_t met = no_triangle;
  Vec3d normal;
  for_each_along(surface.surface(), local_origin, {}, local_way, [&](std::uint32_t number, const Triangle& triangle) {
    const Corners t(triangle, local_origin);
    const Vec3d n = t.normal();
    const double approach = -dot(n, local_way);
    const bool is_through = approach > 0 && dot(local_way, cross(t.a, t.b)) <= 0 &&
                            dot(local_way, cross(t.b, t.c)) <= 0 && dot(local_way, cross(t.c, t.a)) <= 0;
    if (!is_through) return search_limit(nearest);
    const double fraction = -dot(n, t.a) / approach;
    if (!(fraction >= 0) || fraction > nearest || (fraction == nearest && number > met)) return search_limit(nearest);
    nearest = fraction, met = number, normal = n;
    return search_limit(nearest);
  });
  if (met == no_triangle) return std::nullopt;
  const bool starts_inside = nearest == 0;
  const Vec3d unit = starts_inside ? Vec3d{} : (1 / length(normal)) * normal;
  return SurfaceHit{static_cast<float>(nearest), to_float(from + nearest * way), to_float(frame.to_world(unit)),
                    starts_inside, met};
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
