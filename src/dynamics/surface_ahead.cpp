#include "dynamics/surface_ahead.hpp"

#include "geometry/support.hpp"

namespace fathom {
namespace {

/// One triangle of a surface as a body of its own, whose centre is where the other body begins.
Mover mover(const TriangleHull& t, const Mover& surface, const Pose& b_in_a) {
  Mover m;
  m.geometry.type = ShapeType::hull;
  m.geometry.hull.vertices = t.vertices;
  m.geometry.hull.vertex_count = 3;
  for (const Vec3& v : t.vertices) m.radius = max(m.radius, length(v));
  const Vec3 arm = rotate(surface.pose.rotation, b_in_a.position);
  m.pose = {surface.pose.position + arm, 0, surface.pose.rotation};
  m.velocity = surface.velocity;
  m.velocity.linear += cross(surface.velocity.angular, arm);
  return m;
}

/// Bounds of b on its way over the surface `a` within dt (s), in a's frame, and `around` (m).
Aabb swept_bounds(const Mover& a, const Mover& b, const Pose& b_in_a, float around, float dt) {
  const Vec3 way =
      relative(advanced(a.pose, a.velocity, dt), advanced(b.pose, b.velocity, dt)).position - b_in_a.position;
  const float turn = dt * length(b.velocity.angular - a.velocity.angular);
  // An arc leaves its chord by no more than an eighth of its angle times its length.
  const float bend = 0.125f * dt * length(a.velocity.angular) *
                     (length(way) + dt * length(a.velocity.angular) * length(b_in_a.position));
  const Aabb box = bounds(b.geometry, b_in_a);
  return grown(merged(box, {box.lower + way, box.upper + way}), around + min(turn, 2.0f) * b.radius + bend);
}

/// Where a point would get too near to the back of a triangle, and the triangle's normal, in the surface's frame.
struct Stop {
  float part = 1;  ///< of the way
  Vec3 normal;
};

Stop first_stop(const Surface& surface, Vec3 from, Vec3 way, float depth, SurfaceScratch& scratch) {
  Stop first;
  std::vector<std::uint32_t>& triangles = scratch.triangles;
  triangles.clear();
  surface.find(grown({min(from, from + way), max(from, from + way)}, depth), triangles);
  for (const std::uint32_t number : triangles) {
    const TriangleHull t(surface.triangle(number), from);
    const float begin = -t.planes[0].offset, descent = -dot(t.normal(), way), least = min(depth, begin);
    constexpr float along = 0.99999f;  // what goes along a triangle comes nearer by rounding
    if (begin < 0 || begin - descent >= along * least || !(descent > 0)) continue;
    // Where it goes through its plane it must be over the triangle.
    const Vec3 through = (begin / descent) * way;
    bool is_over = true;
    for (int k = 0; k < 3; ++k) {
      const Vec3 edge = t.vertices[(k + 1) % 3] - t.vertices[k];
      is_over &= dot(cross(t.normal(), edge), through - t.vertices[k]) >= -1e-5f * length_squared(edge);
    }
    const float part = (begin - least) / descent;
    if (is_over && part < first.part) first = {part, t.normal()};
  }
  return first;
}

}  // namespace

SurfaceAhead look_ahead(const Mover& a, const Mover& b, const Pose& b_in_a, float margin, float half, float dt,
                        SurfaceScratch& scratch) {
  SurfaceAhead result{b_in_a};
  std::vector<std::uint32_t>& triangles = scratch.triangles;
  triangles.clear();
  const float entry = entry_of(half), skin = skin_of(half, b.radius);
  a.geometry.surface().find(swept_bounds(a, b, b_in_a, min(margin, skin + 2 * entry), dt), triangles);
  float earliest = 3e38f;
  for (const std::uint32_t number : triangles) {
    const TriangleHull triangle(a.geometry.surface().triangle(number), b_in_a.position);
    if (triangle.planes[0].offset > 0) continue;  // b is behind it
    const Mover of_triangle = mover(triangle, a, b_in_a);
    const NearCores cores = near_cores(of_triangle, b, dt, skin);
    const Vec3 normal = rotate(a.pose.rotation, triangle.normal());
    const float gap = separation_along(cores, of_triangle.pose, b.pose, normal);
    const float approach = dt * max_approach(of_triangle, b, normal);
    // What touches it already, or all but, and comes no deeper is held by the contact as it is.
    if (gap <= entry && approach - gap <= 2 * entry) continue;
    if (gap > skin && approach < gap - skin) continue;
    const Impact impact = first_impact(of_triangle, b, cores, dt, skin, normal);
    if (!impact.meets || !(impact.speed > 0)) continue;
    const float deeper = max(impact.gap, 0.0f) + entry;
    const bool gets_deep = impact.speed * (dt - impact.time) >= deeper;
    if (impact.time > 0 && !gets_deep) continue;  // the next step sees it touch
    earliest = min(earliest, gets_deep ? impact.time + deeper / impact.speed : dt);
  }
  if (!(earliest < 3e38f)) return result;
  result.time = earliest;
  result.b_in_a = relative(advanced(a.pose, a.velocity, earliest), advanced(b.pose, b.velocity, earliest));
  return result;
}

CentreWay centre_way(const Mover& a, const Mover& b, const Pose& end_a, const Pose& end_b, float depth,
                     SurfaceScratch& scratch) {
  CentreWay result;
  Vec3 from = inverse_transform(a.pose, b.pose.position), way = inverse_transform(end_a, end_b.position) - from;
  while (result.stops < CentreWay::max_stops) {
    const Stop stop = first_stop(a.geometry.surface(), from, way, depth, scratch);
    if (stop.part >= 1) break;
    from = mul_add(from, stop.part, way);
    way = (1 - stop.part) * way;
    way -= dot(stop.normal, way) * stop.normal;
    result.normals[result.stops++] = rotate(end_a.rotation, stop.normal);
  }
  // In a corner of that many triangles it stays where it was stopped last.
  if (result.stops < CentreWay::max_stops) from += way;
  result.end = transform(end_a, from);
  return result;
}

}  // namespace fathom
