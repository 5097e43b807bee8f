#include "dynamics/surface_ahead.hpp"

#include "geometry/support.hpp"
#include "terrain/triangles_ahead.hpp"

namespace fathom {
namespace {

/// One triangle of a surface as a body of its own, whose centre is where the other body begins.
Mover mover(const SurfaceTriangle& t, const Mover& surface, const Pose& b_in_a) {
  Mover m;
  m.geometry.type = ShapeType::hull;
  m.geometry.hull.vertices = t.corners;
  m.geometry.hull.vertex_count = 3;
  for (const Vec3& v : t.corners) m.radius = max(m.radius, length(v));
  const Vec3 arm = rotate(surface.pose.rotation, b_in_a.position);
  m.pose = {surface.pose.position + arm, 0, surface.pose.rotation};
  m.velocity = surface.velocity;
  m.velocity.linear += cross(surface.velocity.angular, arm);
  return m;
}

/// How b gets over the surface `a` within dt (s), in a's frame.
struct Sweep {
  Vec3 way;      ///< m, of b's centre
  float around;  ///< m, how far beside that way a point of b may get
};
Sweep sweep_of(const Mover& a, const Mover& b, const Pose& b_in_a, float dt) {
  const Vec3 way =
      relative(advanced(a.pose, a.velocity, dt), advanced(b.pose, b.velocity, dt)).position - b_in_a.position;
  const float turn = dt * length(b.velocity.angular - a.velocity.angular);
  // An arc leaves its chord by no more than an eighth of its angle times its length.
  const float bend = 0.125f * dt * length(a.velocity.angular) *
                     (length(way) + dt * length(a.velocity.angular) * length(b_in_a.position));
  return {way, min(turn, 2.0f) * (b.radius - b.geometry.radius) + bend};  // round shapes turn in place
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
    const SurfaceTriangle t(surface.triangle(number), from);
    const float begin = -t.offset, descent = -dot(t.normal, way), least = min(depth, begin);
    constexpr float along = 0.99999f;  // rounding brings a body that slides along a triangle nearer
    if (begin < 0 || begin - descent >= along * least || !(descent > 0)) continue;
    // Where the path crosses the triangle's plane it must be over the triangle.
    const Vec3 through = (begin / descent) * way;
    bool is_over = true;
    for (int k = 0; k < 3; ++k) {
      const Vec3 edge = t.corners[(k + 1) % 3] - t.corners[k];
      is_over &= dot(cross(t.normal, edge), through - t.corners[k]) >= -1e-5f * length_squared(edge);
    }
    const float part = (begin - least) / descent;
    if (is_over && part < first.part) first = {part, t.normal};
  }
  return first;
}

}  // namespace

SurfaceAhead look_ahead(const Mover& a, const Mover& b, const Pose& b_in_a, float margin, float rest, float half,
                        float dt, SurfaceScratch& scratch) {
  SurfaceAhead result{b_in_a};
  const float entry = entry_of(half), skin = skin_of(half, b.radius);
  const Sweep sweep = sweep_of(a, b, b_in_a, dt);
  const Aabb box = bounds(b.geometry, b_in_a);
  const Aabb swept = merged(box, {box.lower + sweep.way, box.upper + sweep.way});
  const float reach = max(min(margin, skin + 2 * entry) + sweep.around, rest);
  result.is_clear = !find_triangles(a.geometry.surface(), grown(swept, reach), b_in_a.position, scratch);
  if (result.is_clear) return result;
  scratch.shape.turn(b.geometry, b_in_a.rotation);
  float earliest = 3e38f;
  const auto meet = [&](const SurfaceTriangle& triangle) {
    if (triangle.offset > 0) return;  // b is behind it
    const Mover of_triangle = mover(triangle, a, b_in_a);
    const NearCores cores = near_cores(of_triangle, b, dt, skin);
    const Vec3 normal = rotate(a.pose.rotation, triangle.normal);
    const float gap = separation_along(cores, of_triangle.pose, b.pose, normal);
    const float approach = dt * max_approach(of_triangle, b, normal);
    // The contact already holds a body that touches, or nearly, and gets no deeper.
    if (gap <= entry && approach - gap <= 2 * entry) return;
    if (gap > skin && approach < gap - skin) return;
    const Impact impact = first_impact(of_triangle, b, cores, dt, skin, normal);
    if (!impact.meets || !(impact.speed > 0)) return;
    const float deeper = max(impact.gap, 0.0f) + entry;
    const bool gets_deep = impact.speed * (dt - impact.time) >= deeper;
    if (impact.time > 0 && !gets_deep) return;  // the next step will see it touch
    earliest = min(earliest, gets_deep ? impact.time + deeper / impact.speed : dt);
  };
  for (const EightTriangles& eight : scratch.eights)
    for (unsigned met = met_on_way(eight, scratch.shape, sweep.way, sweep.around + skin); met != 0; met &= met - 1)
      meet(eight.at(lowest_bit(met)));
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
  // In a corner of that many triangles it stays where the last one stopped it.
  if (result.stops < CentreWay::max_stops) from += way;
  result.end = transform(end_a, from);
  return result;
}

}  // namespace fathom
