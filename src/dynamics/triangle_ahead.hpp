// What a fast body meets of a surface, triangle by triangle, and how far its centre may go. Pure, for host and device:
// the parts that surface_ahead.hpp and the device share.
#pragma once

#include "dynamics/look_ahead.hpp"
#include "terrain/surface_triangle.hpp"

namespace fathom {

struct SurfaceAhead {
  Pose b_in_a;            ///< where manifolds are to be made
  float time = -1;        ///< s from the step's beginning to there; below zero: as the bodies are
  bool is_clear = false;  ///< no triangle is within `rest` of b's bounds, as the bodies are or on the way
};

/// How b gets over the surface `a` within dt (s), in a's frame.
struct SurfaceSweep {
  Vec3 way;      ///< m, of b's centre
  float around;  ///< m, how far beside that way a point of b may get
};
FATHOM_HD SurfaceSweep sweep_over(const Mover& a, const Mover& b, const Pose& b_in_a, float dt) {
  const Vec3 way =
      relative(advanced(a.pose, a.velocity, dt), advanced(b.pose, b.velocity, dt)).position - b_in_a.position;
  const float turn = dt * length(b.velocity.angular - a.velocity.angular);
  // An arc leaves its chord by no more than an eighth of its angle times its length.
  const float bend = 0.125f * dt * length(a.velocity.angular) *
                     (length(way) + dt * length(a.velocity.angular) * length(b_in_a.position));
  return {way, min(turn, 2.0f) * (b.radius - b.geometry.radius) + bend};  // round shapes turn in place
}

/// The box (m, a's frame) in which triangles may meet b: `near` around b now, and `swept` around its way.
FATHOM_HD Aabb box_of_sweep(const Mover& b, const Pose& b_in_a, const SurfaceSweep& sweep, float margin, float rest,
                            float half) {
  const float entry = entry_of(half), skin = skin_of(half, b.radius);
  const Aabb box = bounds(b.geometry, b_in_a);
  const Aabb swept = merged(box, {box.lower + sweep.way, box.upper + sweep.way});
  return grown(swept, max(min(margin, skin + 2 * entry) + sweep.around, rest));
}

/// Time (s) of the first impact of b with the triangle that gets deep within the step; 3e38 if there is none. The
/// triangle is relative to b's centre. `half`: half of b's thickness (m).
FATHOM_HD float deep_impact(const SurfaceTriangle& triangle, const Mover& a, const Mover& b, const Pose& b_in_a,
                            float half, float dt) {
  constexpr float never = 3e38f;
  if (triangle.offset > 0) return never;  // b is behind it
  const float entry = entry_of(half), skin = skin_of(half, b.radius);
  // The triangle as a body of its own, whose centre is where b begins.
  Mover of_triangle;
  of_triangle.geometry.type = ShapeType::hull;
  of_triangle.geometry.hull.vertices = triangle.corners;
  of_triangle.geometry.hull.vertex_count = 3;
  for (const Vec3& v : triangle.corners) of_triangle.radius = max(of_triangle.radius, length(v));
  const Vec3 arm = rotate(a.pose.rotation, b_in_a.position);
  of_triangle.pose = {a.pose.position + arm, 0, a.pose.rotation};
  of_triangle.velocity = a.velocity;
  of_triangle.velocity.linear += cross(a.velocity.angular, arm);

  const NearCores cores = near_cores(of_triangle, b, dt, skin);
  const Vec3 normal = rotate(a.pose.rotation, triangle.normal);
  const float gap = separation_along(cores, of_triangle.pose, b.pose, normal);
  const float approach = dt * max_approach(of_triangle, b, normal);
  // The contact already holds a body that touches, or nearly, and gets no deeper.
  if (gap <= entry && approach - gap <= 2 * entry) return never;
  if (gap > skin && approach < gap - skin) return never;
  const Impact impact = first_impact(of_triangle, b, cores, dt, skin, normal);
  if (!impact.meets || !(impact.speed > 0)) return never;
  const float deeper = max(impact.gap, 0.0f) + entry;
  const bool gets_deep = impact.speed * (dt - impact.time) >= deeper;
  if (impact.time > 0 && !gets_deep) return never;  // the next step will see it touch
  return gets_deep ? impact.time + deeper / impact.speed : dt;
}

/// Notes that manifolds are to be made `time` (s) after the step's beginning.
FATHOM_HD void set_ahead(SurfaceAhead& ahead, const Mover& a, const Mover& b, float time) {
  ahead.time = time;
  ahead.b_in_a = relative(advanced(a.pose, a.velocity, time), advanced(b.pose, b.velocity, time));
}

/// Where b's centre gets to on its way to the end of the step if it may come no nearer to the back of a triangle than
/// `depth` (m), or than it was: from there on it moves along the triangle.
struct CentreWay {
  static constexpr int max_stops = 4;
  int stops = 0;
  Vec3 normals[max_stops];  ///< of the triangles that stopped it, world axes
  bool slows[max_stops];    ///< it was `depth` from the triangle, or nearly, as the step began
  Vec3 end;                 ///< m, world; unset if nothing stopped it
};

/// Shares of half a piece's thickness. A piece that moves no farther within a step is pushed out long before many such
/// steps could take it through; one held back that little already stops at the same position again.
inline constexpr float surface_creep = 1.0f / 32, already_there = 1e-3f;

/// Linear velocity (m/s) of a body with the velocity `v`, held back to `end` (m, its centre) on the way of one of its
/// pieces: it loses its approach to those triangles of a surface at which it began the step. Any other impact becomes a
/// contact of the next step, which needs the velocity to rebound. `of_a`, `a`: the surface's velocity and centre (m).
FATHOM_HD Vec3 slowed_by_triangles(const CentreWay& way, Vec3 end, const Velocity& of_a, Vec3 a, const Velocity& v) {
  const Vec3 of_point = of_a.linear + cross(of_a.angular, way.end - a);
  const Vec3 of_piece = cross(v.angular, way.end - end);
  Vec3 linear = v.linear;
  for (int i = 0; i < way.stops; ++i)
    if (way.slows[i])
      linear = mul_add(linear, max(dot(way.normals[i], of_point - of_piece - linear), 0.0f), way.normals[i]);
  return linear;
}

/// Where a point would get too near to the back of a triangle, and the triangle's normal, in the surface's frame.
struct CentreStop {
  float part = 1;      ///< of the way
  float distance = 0;  ///< m, of the way's first point
  Vec3 normal;
};

/// `for_each_in(box, act)` calls act(triangle) for the surface's triangles in a box, in its frame.
FATHOM_HD CentreStop first_stop(const auto& for_each_in, Vec3 from, Vec3 way, float depth) {
  CentreStop first;
  for_each_in(grown(Aabb{min(from, from + way), max(from, from + way)}, depth), [&](const Triangle& triangle) {
    const SurfaceTriangle t(triangle, from);
    const float begin = -t.offset, descent = -dot(t.normal, way), least = min(depth, begin);
    constexpr float along = 0.99999f;  // rounding brings a body that slides along a triangle nearer
    if (begin < 0 || begin - descent >= along * least || !(descent > 0)) return;
    // Where the path crosses the triangle's plane it must be over the triangle.
    const Vec3 through = (begin / descent) * way;
    bool is_over = true;
    for (int k = 0; k < 3; ++k) {
      const Vec3 edge = t.corners[(k + 1) % 3] - t.corners[k];
      is_over &= dot(cross(t.normal, edge), through - t.corners[k]) >= -1e-5f * length_squared(edge);
    }
    const float part = (begin - least) / descent;
    if (is_over && part < first.part) first = {part, begin, t.normal};
  });
  return first;
}

/// The centre's way from `begin_b` to `end_b` (m, world) while the surface goes from `begin_a` to `end_a`.
FATHOM_HD CentreWay centre_way(const auto& for_each_in, const Pose& begin_a, const Pose& end_a, Vec3 begin_b,
                               Vec3 end_b, float depth) {
  CentreWay result;
  const Vec3 start = inverse_transform(begin_a, begin_b);
  const float near = depth + skin_of(depth, depth);
  Vec3 from = start, way = inverse_transform(end_a, end_b) - from;
  while (result.stops < CentreWay::max_stops) {
    const CentreStop stop = first_stop(for_each_in, from, way, depth);
    if (stop.part >= 1) break;
    result.slows[result.stops] = stop.distance + dot(stop.normal, start - from) <= near;
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
