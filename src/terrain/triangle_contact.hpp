// Contact of a triangle of a surface with a convex shape. Pure, for host and device.
//
// All in the same axes with the convex shape's centre as origin, so that surfaces of kilometres cost no precision. A
// triangle is solid behind: bodies touch only its outside, and axes across its edges and corners count only if the
// adjacent surface does not rise along them. So a flat floor of many triangles has no edges to catch on.
#pragma once

#include "collision/collide.hpp"
#include "terrain/part_under.hpp"
#include "terrain/triangle_axes-inl.hpp"

namespace fathom {

struct TriangleContact {
  Manifold manifold;
  /// The shape reaches behind the triangle and probably touches another side of the surface there: it has a shorter
  /// way out in a direction in which the adjacent surface rises.
  bool is_doubtful = false;
  bool is_deep = false;  ///< … and reaches deeper than the shape is thick
};

/// Corners of a triangle, or of its neighbours, that an axis asks about.
struct SharedCorners {
  std::uint32_t names[3] = {};
  int count = 0;

  FATHOM_HD SharedCorners(const SurfaceTriangle& t, unsigned tips) {
    for (unsigned k = 0; k < 3; ++k)
      if (tips >> k & 1) names[count++] = t.names[k];
  }
  FATHOM_HD bool have(std::uint32_t name) const {
    for (int i = 0; i < count; ++i)
      if (names[i] == name) return true;
    return false;
  }
  /// Whether the triangle has all of them.
  FATHOM_HD bool are_in(const std::uint32_t (&corners)[3]) const {
    for (int i = 0; i < count; ++i)
      if (corners[0] != names[i] && corners[1] != names[i] && corners[2] != names[i]) return false;
    return true;
  }
};

constexpr unsigned all_tips = 7;
/// Ends of edge k.
FATHOM_HD unsigned tips_of_edge(int k) { return 1u << k | 1u << (k + 1) % 3; }

/// Whether the nearest triangle is behind a point, given squared distances (m²) from the nearest triangles that it is
/// in front of and behind. Both are equal at a common edge, which then is a ridge.
FATHOM_HD bool is_behind(float in_front, float behind) { return in_front > 1.0001f * behind; }

/// The corners between which the triangle's point nearest to `point` lies: one, two, or all three.
FATHOM_HD unsigned nearest_tips(const SurfaceTriangle& t, Vec3 point) {
  float nearest = 3e38f;
  bool is_over = true;
  unsigned tips = 0;
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    const Vec3 along = t.corners[next] - t.corners[k], way = point - t.corners[k];
    is_over = is_over && dot(cross(t.normal, along), way) >= 0;
    const float s = dot(way, along) / length_squared(along), squared = length_squared(way - max(0, min(1, s)) * along);
    if (squared >= nearest) continue;
    nearest = squared;
    tips = s <= 0 ? 1u << k : s >= 1 ? 1u << next : tips_of_edge(k);
  }
  return is_over ? all_tips : tips;
}

/// A walk around the shared corner or along the shared edge, through a triangle that has it: the name at which it
/// leaves the triangle, less that at which it enters. Over all triangles around a corner, or on both sides of an edge,
/// this adds up to 0; at a border it does not.
FATHOM_HD std::uint32_t walk_past(const std::uint32_t (&names)[3], const SharedCorners& shared) {
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t at = names[k], next = names[(k + 1) % 3], last = names[(k + 2) % 3];
    if (shared.count == 1 && shared.have(at)) return next - last;
    if (shared.count == 2 && shared.have(at) && shared.have(next)) return next - at;
  }
  return 0;
}

/// Whether `other`, which has the shared corners of `t`, rises along the axis.
FATHOM_HD bool does_rise(const SurfaceTriangle& t, const SurfaceTriangle& other, const SharedCorners& shared,
                         Vec3 axis) {
  constexpr float flat = 2e-5f;  // sine of the largest angle that rounding can cause
  if (other.names[0] == t.names[0] && other.names[1] == t.names[1] && other.names[2] == t.names[2]) return false;
  Vec3 at;
  for (int k = 0; k < 3; ++k)
    if (shared.have(other.names[k])) at = other.corners[k];
  for (int k = 0; k < 3; ++k) {
    if (shared.have(other.names[k])) continue;
    const Vec3 way = other.corners[k] - at;
    const float height = dot(way, axis);
    if (height > 0 && height * height > flat * flat * length_squared(way)) return true;
  }
  return false;
}

/// A triangle as a hull with two faces; the first faces outward.
class TriangleHull {
 public:
  FATHOM_HD TriangleHull(const SurfaceTriangle& t, float outer)
      : planes_{{t.normal, t.offset}, {-t.normal, -t.offset}} {
    static constexpr Hull::HalfEdge edges[6] = {{2, 0, 0}, {5, 1, 1}, {4, 1, 0}, {1, 2, 1}, {0, 2, 0}, {3, 0, 1}};
    static constexpr std::uint16_t face_edges[2] = {0, 1};
    view_ = {t.corners, edges, planes_, face_edges, 3, 6, 2};
    view_.inner = outer, view_.outer = outer;  // the other shape is the thin one
  }
  TriangleHull(const TriangleHull&) = delete;
  TriangleHull& operator=(const TriangleHull&) = delete;
  FATHOM_HD const HullView& view() const { return view_; }

 private:
  Hull::Plane planes_[2];
  HullView view_;
};

FATHOM_HD float largest_coordinate(const SurfaceTriangle& t) {
  return max(max_component(abs(t.corners[0])), max(max_component(abs(t.corners[1])), max_component(abs(t.corners[2]))));
}

/// The corners farthest along the axis, within `tolerance` (m).
FATHOM_HD unsigned tips_along(const SurfaceTriangle& t, Vec3 axis, float tolerance) {
  const float heights[] = {dot(t.corners[0], axis), dot(t.corners[1], axis), dot(t.corners[2], axis)};
  const float highest = max(heights[0], max(heights[1], heights[2]));
  unsigned tips = 0;
  for (unsigned k = 0; k < 3; ++k) tips |= (heights[k] >= highest - tolerance ? 1u : 0u) << k;
  return tips;
}

/// Whether bodies that touch the corners `tips` may be pushed along the axis (unit, away from the triangle): not
/// inward, and not where the adjacent surface rises.
FATHOM_HD bool may_push(const SurfaceTriangle& t, Vec3 axis, unsigned tips, const auto& around) {
  constexpr float inward = -0.1f;  // allows axes across the normals at ridges of back-to-back faces
  return tips != all_tips && dot(axis, t.normal) > inward && !around.rises(t, tips, axis);
}

/// Replaces the triangle's own corner and edge indices with global names, so that points of neighbouring triangles on a
/// shared corner or edge have the same feature in every step.
FATHOM_HD void name_features(const SurfaceTriangle& t, Manifold& m) {
  for (int i = 0; i < m.count; ++i) {
    std::uint32_t& feature = m.points[i].feature;
    const auto kind = static_cast<FeatureKind>(feature >> 30);
    const std::uint32_t a = feature >> 15 & 0x7fff, b = feature & 0x7fff;
    if (kind == FeatureKind::vertex_of_a) {
      feature = make_feature(kind, t.names[a % 3] & 0x7fff, b);
    } else if (kind == FeatureKind::edges) {
      const std::uint32_t p = t.names[a % 3], q = t.names[(a + 1) % 3];
      feature = make_feature(kind, ((p < q ? p : q) * 31 + (p < q ? q : p)) & 0x7fff, b);
    }
  }
}

/// Unit normal across edge k of the triangle and the shape's edge.
FATHOM_HD Vec3 edge_normal(const SurfaceTriangle& t, int k, const EdgeArc& of_shape) {
  const Vec3 along = t.corners[(k + 1) % 3] - t.corners[k];
  const Vec3 across = cross(along, of_shape.along);
  const Vec3 axis = dot(across, cross(t.normal, along)) > 0 ? -across : across;
  return (1 / length(axis)) * axis;
}

FATHOM_HD void edge_contact(const SurfaceTriangle& t, const HullView& shape, const EdgesAxis& axis, float margin,
                            Manifold& m) {
  const Vec3 from = t.corners[axis.a];
  const EdgeView b = edge_view(shape, axis.b);
  const SegmentPair closest = closest_points({from, t.corners[(axis.a + 1) % 3] - from}, {b.from, b.along});
  const float separation = dot(axis.normal, b.from - from);
  if (separation > 0 && length_squared(closest.on_2 - closest.on_1) > margin * margin) return;
  m.normal = axis.normal;
  m.count = 1;
  m.points[0].position = 0.5f * (closest.on_1 + closest.on_2);
  m.points[0].separation = separation;
  m.points[0].feature = edge_feature(static_cast<std::uint32_t>(axis.a), static_cast<std::uint32_t>(axis.b), false);
}

/// Says whether a contact along the triangle's normal is doubtful. `nearest`: its least separation (m); `is_refused`:
/// another axis is better, but the adjacent surface rises along it; `inner`: half the shape's smallest thickness (m).
FATHOM_HD void doubt(float nearest, bool is_refused, float inner, const Tolerance& tolerance,
                     TriangleContact& contact) {
  contact.is_deep = nearest < -inner;
  contact.is_doubtful = contact.is_deep || (is_refused && nearest < -tolerance.axis);
}

/// The contact with a shape that overlaps the triangle although its face that is nearest has no part over it: the
/// deepest point of what is under the triangle, if that is no matter of rounding. A rod that stands in the ground
/// aslant has its lower end under other triangles, which it does not touch. So that end counts instead, unless it has
/// come out of the ground again, as behind a ridge or beyond a border, or comes out sooner elsewhere.
FATHOM_HD void hidden_contact(const SurfaceTriangle& t, const HullPair& pair, const HullView& shape,
                              bool may_pass_through, float tolerance, const auto& around, Manifold& m) {
  ManifoldPoint& point = m.points[0];
  if (may_pass_through) {
    hull_vertex_contact(pair, 0, false, m);
    const Vec3 end = mul_add(point.position, 0.5f * point.separation, t.normal);
    if (!around.is_nearer_elsewhere(end, -point.separation, tolerance) && around.is_inside(end, tolerance)) return;
  }
  const PointUnder under = deepest_under(t, shape);
  m.normal = t.normal;
  m.count = under.height < -tolerance ? 1 : 0;
  point = {mul_add(under.at, -0.5f * under.height, t.normal), under.height, under.feature};
}

/// Of the shape's core.
FATHOM_HD TriangleContact collide_core(const SurfaceTriangle& t, const AxesOfTriangles<OneLane>& axes,
                                       const auto& shape, float margin, const auto& around) {
  TriangleContact contact;
  Manifold& m = contact.manifold;
  const HullView& b = shape.turned();
  bool is_refused = false, overlaps = axes.of_face <= 0 && axes.of_normal <= 0;
  if (axes.edge >= 0) {
    const Vec3 normal = edge_normal(t, axes.edge, shape.edge(axes.edge_of_shape));
    if (may_push(t, normal, tips_of_edge(axes.edge), around)) {
      edge_contact(t, b, {axes.edge, axes.edge_of_shape, 0, normal}, margin, m);
      return contact;
    }
    is_refused = true;
    overlaps &= dot(normal, edge_view(b, axes.edge_of_shape).from - t.corners[axes.edge]) <= 0;
  }
  const TriangleHull hull(t, largest_coordinate(t));
  HullPair pair = make_hull_pair(hull.view(), shape.hull(), {{}, 0, shape.rotation()});
  Tolerance& tolerance = pair.tolerance;
  tolerance.side = tolerance.noise;  // sides moved outward would meet far beyond a sharp corner
  const int face = axes.face;
  const Vec3 out_of_shape = face >= 0 ? -b.planes[face].normal : Vec3{};
  const bool is_nearer = axes.of_face > axes.of_normal + tolerance.axis;
  const bool by_shape =
      is_nearer && may_push(t, out_of_shape, tips_along(t, out_of_shape, tolerance.depth_tie), around);
  is_refused |= is_nearer;
  AxisCache unused;
  hull_face_contact(pair, by_shape ? face : 0, by_shape, margin, {}, unused, m);
  if (by_shape) return contact;
  const bool is_hidden = m.count == 0 && overlaps;
  if (is_hidden) {
    const float at_sides = make_tolerance(shape.inner(), shape.outer()).side;
    const bool may_pass_through = is_refused && axes.of_normal < -shape.inner();
    hidden_contact(t, pair, b, may_pass_through, at_sides, around, m);
  }
  if (m.count > 0) doubt(nearest_separation(m) - b.radius, is_refused, shape.inner(), tolerance, contact);
  contact.is_doubtful |= is_hidden && is_refused;
  return contact;
}

/// One point at the nearest edge or corner, or two at the ends of the part of the core that is over the triangle, each
/// with the edge that clipped it.
FATHOM_HD TriangleContact collide_round(const SurfaceTriangle& t, const auto& shape, float margin, const auto& around) {
  TriangleContact contact;
  Manifold& m = contact.manifold;
  const RoundShape& round = shape.round();
  const Segment& core = round.core;
  const Hull::Plane plane{t.normal, t.offset};
  const float height_from = plane_height(plane, core.from), height_end = plane_height(plane, end_of(core));
  const float reach = round.radius + margin;

  const float extent = largest_coordinate(t);
  const TriangleHull hull(t, extent);
  const Tolerance tolerance = make_tolerance(round.radius, extent);
  const Stretch over = clip_segment(hull.view(), 0, core, tolerance.noise);
  float lowest_over = 3e38f;
  if (!over.empty())
    lowest_over =
        min(fma(over.lo, height_end - height_from, height_from), fma(over.hi, height_end - height_from, height_from));

  SegmentPair nearest{};
  float nearest_squared = 3e38f;
  int nearest_edge = 0;
  bool at_corner = true;
  constexpr float corner_handicap = 1e-6f;
  for (int k = 0; k < 3; ++k) {
    const SegmentPair pair = closest_points({t.corners[k], t.corners[(k + 1) % 3] - t.corners[k]}, core);
    const float squared = length_squared(pair.on_2 - pair.on_1);
    // Rounding hides which is nearer, a corner or a point on the edge beside it. From the corner, that edge rises.
    const bool is_corner = pair.s <= 0 || pair.s >= 1;
    const float handicap = is_corner == at_corner ? 1 : is_corner ? 1 - corner_handicap : 1 + corner_handicap;
    if (squared < nearest_squared * handicap)
      nearest = pair, nearest_squared = squared, nearest_edge = k, at_corner = is_corner;
  }
  const bool by_face =
      lowest_over < 3e38f && (lowest_over <= 0 || lowest_over * lowest_over <= nearest_squared * (1 + 1e-5f));
  if (!by_face) {
    const float gap = fathom::sqrt(nearest_squared);
    if (gap > reach) return contact;
    const Vec3 axis = (1.0f / gap) * (nearest.on_2 - nearest.on_1);
    const unsigned tips =
        nearest.s <= 0 || nearest.s >= 1 ? 1u << (nearest_edge + (nearest.s > 0)) % 3 : tips_of_edge(nearest_edge);
    if (gap > tolerance.noise && may_push(t, axis, tips, around)) {
      m.normal = axis;
      add_round_point(m, nearest.on_1, 0, gap, round.radius, segment_feature(nearest.t, nearest_edge));
      return contact;
    }
  }
  if (over.empty()) return contact;
  m.normal = plane.normal;
  const bool one = length(core.along) * (over.hi - over.lo) <= tolerance.side;
  for (int i = 0; i < (one ? 1 : 2); ++i) {
    const float at = i == 0 ? over.lo : over.hi, height = fma(at, height_end - height_from, height_from);
    if (height > reach) continue;
    const Vec3 point = mul_add(core.from, at, core.along);
    const int edge = i == 0 ? over.lo_edge : over.hi_edge;
    add_round_point(m, mul_add(point, -height, plane.normal), 0, height, round.radius,
                    segment_feature(at, (edge > 0 ? edge : 0) >> 1));
  }
  if (m.count > 0) doubt(nearest_separation(m), !by_face, shape.inner(), tolerance, contact);
  return contact;
}

/// An edge of a rounded hull, for `collide_round`.
struct RoundEdge {
  RoundShape capsule;
  float half_thickness;  ///< of the hull (m)

  FATHOM_HD const RoundShape& round() const { return capsule; }
  FATHOM_HD float inner() const { return half_thickness; }
};

/// As `collide_rounded`.
FATHOM_HD TriangleContact collide_polyhedron(const SurfaceTriangle& t, const AxesOfTriangles<OneLane>& axes,
                                             const auto& shape, float margin, const auto& around) {
  const HullView& b = shape.turned();
  TriangleContact contact = collide_core(t, axes, shape, margin + b.radius, around);
  if (b.radius == 0) return contact;
  Manifold& m = contact.manifold;
  const TriangleHull hull(t, largest_coordinate(t));
  const HullPair p = make_hull_pair(hull.view(), b, {});
  const Vec3 guess = m.count > 0 ? m.normal : t.normal;
  const Gap gap =
      gap_between(Core{{}, {}, hull.view(), 0}, Core{{}, {}, b, b.radius}, p.b_in_a, guess, p.tolerance.noise);
  if (gap.distance > margin + b.radius) return {};
  if (!is_at_corner(gap.distance, m, p.tolerance.noise)) {
    round_off(m, 0, b.radius);
    return contact;
  }
  const EdgesAcross edges(b, -gap.normal);
  TriangleContact corner;
  for (int k = 0; k < edges.count; ++k) {
    const int edge = edges.edges[k];
    TriangleContact of_edge = collide_round(t, RoundEdge{edge_capsule(b, edge), shape.inner()}, margin, around);
    Manifold& points = of_edge.manifold;
    for (int i = 0; i < points.count; ++i) points.points[i].feature += static_cast<std::uint32_t>(2 * edge);
    if (k == 0 || nearest_separation(points) < nearest_separation(corner.manifold)) corner = of_edge;
  }
  const bool is_face = !is_at_corner(gap.distance, m, p.tolerance.axis);  // a face that is almost best is nearest
  if (is_face && miss_of(corner.manifold, gap.distance - b.radius) > miss_of(m, gap.distance)) {
    round_off(m, 0, b.radius);
    return contact;
  }
  return corner;
}

/// The contact where a triangle and the shape are nearer than `margin` (m); the normal points from the triangle to the
/// shape. `axes` must call the triangle near. `around.rises(triangle, tips, axis)`: whether the surface adjacent to the
/// triangle at its shared corners `tips` (a bit each) rises above the plane through them with normal `axis` (unit,
/// outward). `around.is_nearer_elsewhere(point, depth, tolerance)`: whether a point `depth` behind the triangle is
/// nearer (m) to another one: it has a shorter way out there, or is outside. `around.is_inside(point, depth)`: whether
/// the point is behind the nearest triangle, by at least `depth`, and not beyond a border. The shape is one of
/// `axes_of`, with hull() and rotation() in addition.
FATHOM_HD TriangleContact collide_triangle(const SurfaceTriangle& triangle, const AxesOfTriangles<OneLane>& axes,
                                           const auto& shape, float margin, const auto& around) {
  TriangleContact contact = shape.is_round() ? collide_round(triangle, shape, margin, around)
                                             : collide_polyhedron(triangle, axes, shape, margin, around);
  name_features(triangle, contact.manifold);
  return contact;
}

}  // namespace fathom
