#include "terrain/triangle_contact.hpp"

#include <algorithm>

#include "collision/collide.hpp"
#include "math/vec3d.hpp"

namespace fathom {
namespace {

HullView view(const TriangleHull& t, float outer) {
  HullView hull{t.vertices, t.edges, t.planes, t.face_edges, 3, 6, 2};
  hull.inner = outer, hull.outer = outer;  // it is the other shape that is thin
  return hull;
}

float largest_coordinate(const TriangleHull& t) {
  return max(max_component(abs(t.vertices[0])),
             max(max_component(abs(t.vertices[1])), max_component(abs(t.vertices[2]))));
}

/// The corners that reach farthest along the axis, within `tolerance` (m).
unsigned tips_along(const TriangleHull& t, Vec3 axis, float tolerance) {
  const float heights[] = {dot(t.vertices[0], axis), dot(t.vertices[1], axis), dot(t.vertices[2], axis)};
  const float highest = max(heights[0], max(heights[1], heights[2]));
  unsigned tips = 0;
  for (unsigned k = 0; k < 3; ++k) tips |= (heights[k] >= highest - tolerance ? 1u : 0u) << k;
  return tips;
}

constexpr unsigned all_tips = 7;

/// Whether bodies may be pushed along the axis (unit, away from the triangle) where they touch its corners `tips`:
/// never inward, and not where the surface beside rises.
bool may_push(const TriangleHull& t, Vec3 axis, unsigned tips, const Surroundings& around) {
  constexpr float inward = -0.1f;  // ridges of two faces back to back have axes across them
  return tips != all_tips && dot(axis, t.normal()) > inward && !around.rises(t, tips, axis);
}

/// Ends of edge k.
unsigned tips_of_edge(int k) { return 1u << k | 1u << (k + 1) % 3; }

/// The triangle's own numbers of corners and edges become names, so that points of neighbours that meet in the same
/// corner or edge are called the same, from step to step.
void name_features(const TriangleHull& t, Manifold& m) {
  for (int i = 0; i < m.count; ++i) {
    std::uint32_t& feature = m.points[i].feature;
    const auto kind = static_cast<FeatureKind>(feature >> 30);
    const std::uint32_t a = feature >> 15 & 0x7fff, b = feature & 0x7fff;
    if (kind == FeatureKind::vertex_of_a) {
      feature = make_feature(kind, t.names[a % 3] & 0x7fff, b);
    } else if (kind == FeatureKind::edges) {
      const std::uint32_t p = t.names[a % 3], q = t.names[(a + 1) % 3];
      feature = make_feature(kind, (std::min(p, q) * 31 + std::max(p, q)) & 0x7fff, b);
    }
  }
}

// --- boxes and hulls -----------------------------------------------------------------------------------------

struct BestFace {
  int face = -1;
  float separation = -3e38f;
};

/// The shape's face that the triangle is highest over.
BestFace best_face(const HullView& shape, const TriangleHull& t) {
  BestFace best;
  for (int f = 0; f < shape.face_count; ++f) {
    const Vec3 n = shape.planes[f].normal;
    const float lowest = min(dot(n, t.vertices[0]), min(dot(n, t.vertices[1]), dot(n, t.vertices[2])));
    if (lowest - shape.planes[f].offset > best.separation) best = {f, lowest - shape.planes[f].offset};
  }
  return best;
}

/// An edge of the triangle.
struct TriangleEdge {
  Vec3 from, along, inward;
};

/// An edge of a triangle has all normals across it that do not point into the triangle, an edge of a hull those
/// between its faces'. Most pairs have none in common, which their signs tell before there is a root.
EdgesAxis edges_axis(const TriangleEdge& e, const EdgeArc& of_shape, float noise) {
  const Vec3 across = cross(e.along, of_shape.along);
  const Vec3 axis = dot(across, e.inward) > 0 ? -across : across;
  // Into the shape: between the normals of the faces beside its edge.
  if (dot(axis, of_shape.of_left) * dot(axis, of_shape.of_right) > 0 || dot(axis, of_shape.middle) >= 0) return {};
  const float l = length(axis);
  if (!(l > min_cross)) return {};
  const Vec3 normal = (1 / l) * axis;
  const float scaled_noise = noise * fathom::sqrt(length_squared(e.along) * length_squared(of_shape.along)) / l;
  return {0, 0, dot(normal, of_shape.from - e.from) - scaled_noise, normal};
}

EdgesAxis best_edges(const TriangleHull& t, const TurnedShape& shape, float threshold, float noise) {
  TriangleEdge edges[3];
  for (int k = 0; k < 3; ++k) {
    const Vec3 from = t.vertices[k], along = t.vertices[(k + 1) % 3] - from;
    edges[k] = {from, along, cross(t.normal(), along)};
  }
  BestEdges found(threshold);
  int number = 0;
  for (const EdgeArc& arc : shape.edges()) {
    for (int k = 0; k < 3; ++k) {
      const EdgesAxis axis = edges_axis(edges[k], arc, noise);
      if (axis.separation > found.best.separation) found.offer(axis, k, number);
    }
    ++number;
  }
  return found.best;
}

void edge_contact(const TriangleHull& t, const HullView& shape, const EdgesAxis& axis, float margin, Manifold& m) {
  const Vec3 from = t.vertices[axis.a];
  const EdgeView b = edge_view(shape, axis.b);
  const SegmentPair closest = closest_points({from, t.vertices[(axis.a + 1) % 3] - from}, {b.from, b.along});
  const float separation = dot(axis.normal, b.from - from);
  if (separation > 0 && length_squared(closest.on_2 - closest.on_1) > margin * margin) return;
  m.normal = axis.normal;
  m.count = 1;
  m.points[0].position = 0.5f * (closest.on_1 + closest.on_2);
  m.points[0].separation = separation;
  m.points[0].feature = edge_feature(static_cast<std::uint32_t>(axis.a), static_cast<std::uint32_t>(axis.b), false);
}

TriangleContact collide_polyhedron(const TriangleHull& t, const TurnedShape& shape, float margin,
                                   const Surroundings& around) {
  TriangleContact contact;
  Manifold& m = contact.manifold;
  const HullView& b = shape.turned();
  const Support lowest = lowest_vertex(b, t.normal());
  const float of_normal = lowest.height - t.planes[0].offset;
  if (of_normal > margin) return contact;
  const BestFace face = best_face(b, t);
  if (face.separation > margin) return contact;

  const float reach = largest_coordinate(t);
  HullPair pair = make_hull_pair(view(t, reach), shape.hull(), {{}, 0, shape.rotation()});
  Tolerance& tolerance = pair.tolerance;
  tolerance.side = tolerance.noise;  // sides put outward would meet far beyond a sharp corner
  const float of_faces = max(of_normal, face.separation);
  const EdgesAxis edges = best_edges(t, shape, of_faces + tolerance.axis, tolerance.noise);
  if (edges.a >= 0 && edges.separation > margin) return contact;

  if (edges.a >= 0 && may_push(t, edges.normal, tips_of_edge(edges.a), around)) {
    edge_contact(t, b, edges, margin, m);
    return contact;
  }
  const Vec3 out_of_shape = face.face >= 0 ? -b.planes[face.face].normal : Vec3{};
  const bool by_shape = face.separation > of_normal + tolerance.axis &&
                        may_push(t, out_of_shape, tips_along(t, out_of_shape, tolerance.depth_tie), around);
  AxisCache unused;
  hull_face_contact(pair, by_shape ? face.face : 0, by_shape, margin, {}, unused, m);
  contact.is_deep = !by_shape && m.count > 0 && nearest_of(m) < -shape.inner();
  return contact;
}

// --- spheres and capsules ------------------------------------------------------------------------------------

/// Ends of the core's part over the triangle, and what cut it there.
Manifold collide_round(const TriangleHull& t, const TurnedShape& shape, float margin, const Surroundings& around) {
  Manifold m;
  const RoundShape& round = shape.round();
  const Segment& core = round.core;
  const Hull::Plane& plane = t.planes[0];
  const float height_from = plane_height(plane, core.from), height_end = plane_height(plane, end_of(core));
  const float reach = round.radius + margin;
  if (min(height_from, height_end) > reach) return m;

  const float extent = largest_coordinate(t);
  const HullView hull = view(t, extent);
  const Tolerance tolerance = make_tolerance(round.radius, extent);
  const Stretch over = clip_segment(hull, 0, core, tolerance.noise);
  float lowest_over = 3e38f;
  if (!over.empty())
    lowest_over =
        min(fma(over.lo, height_end - height_from, height_from), fma(over.hi, height_end - height_from, height_from));

  SegmentPair nearest{};
  float nearest_squared = 3e38f;
  int nearest_edge = 0;
  for (int k = 0; k < 3; ++k) {
    const SegmentPair pair = closest_points({t.vertices[k], t.vertices[(k + 1) % 3] - t.vertices[k]}, core);
    const float squared = length_squared(pair.on_2 - pair.on_1);
    if (squared < nearest_squared) nearest = pair, nearest_squared = squared, nearest_edge = k;
  }
  const bool by_face =
      lowest_over < 3e38f && (lowest_over <= 0 || lowest_over * lowest_over <= nearest_squared * (1 + 1e-5f));
  if (!by_face) {
    const float gap = fathom::sqrt(nearest_squared);
    if (gap > reach) return m;
    const Vec3 axis = (1.0f / gap) * (nearest.on_2 - nearest.on_1);
    const unsigned tips =
        nearest.s <= 0 || nearest.s >= 1 ? 1u << (nearest_edge + (nearest.s > 0)) % 3 : tips_of_edge(nearest_edge);
    if (gap > tolerance.noise && may_push(t, axis, tips, around)) {
      m.normal = axis;
      add_round_point(m, nearest.on_1, 0, gap, round.radius, segment_feature(nearest.t, nearest_edge));
      return m;
    }
  }
  if (over.empty()) return m;
  m.normal = plane.normal;
  const bool one = length(core.along) * (over.hi - over.lo) <= tolerance.side;
  for (int i = 0; i < (one ? 1 : 2); ++i) {
    const float at = i == 0 ? over.lo : over.hi, height = fma(at, height_end - height_from, height_from);
    if (height > reach) continue;
    const Vec3 point = mul_add(core.from, at, core.along);
    const int edge = i == 0 ? over.lo_edge : over.hi_edge;
    add_round_point(m, mul_add(point, -height, plane.normal), 0, height, round.radius,
                    segment_feature(at, std::max(edge, 0) >> 1));
  }
  return m;
}

}  // namespace

TriangleHull::TriangleHull(const Triangle& triangle, Vec3 origin) {
  for (int k = 0; k < 3; ++k) vertices[k] = triangle.corners[k] - origin, names[k] = triangle.vertices[k];
  // In double precision: triangles may be a kilometre long and a millimetre wide.
  const Vec3d a = to_double(triangle.corners[0]);
  const Vec3d n = cross(to_double(triangle.corners[1]) - a, to_double(triangle.corners[2]) - a);
  planes[0].normal = to_float((1 / fathom::length(n)) * n);
  planes[0].offset = dot(planes[0].normal, vertices[0]);
  planes[1] = {-planes[0].normal, -planes[0].offset};
}

TurnedShape::TurnedShape(const Geometry& shape, Quat rotation)
    : rotation_(rotation), box_(shape.type == ShapeType::box ? shape.half_extents : Vec3{1, 1, 1}) {
  if (fathom::is_round(shape)) {
    round_ = transform({{}, 0, rotation}, round_shape(shape));
    inner_ = round_.radius;
    outer_ = max_component(abs(round_.core.from)) + round_.radius;
    return;
  }
  hull_ = shape.type == ShapeType::box ? fathom::view(box_) : shape.hull;
  const HullSize size = size_of(hull_);
  inner_ = size.inner, outer_ = size.outer;
  hull_.inner = inner_, hull_.outer = outer_;
  const Mat3 turn = to_matrix(rotation);
  vertices_.reserve(static_cast<std::size_t>(hull_.vertex_count));
  planes_.reserve(static_cast<std::size_t>(hull_.face_count));
  edges_.reserve(static_cast<std::size_t>(hull_.edge_count / 2));
  for (int i = 0; i < hull_.vertex_count; ++i) vertices_.push_back(turn * hull_.vertices[i]);
  for (int i = 0; i < hull_.face_count; ++i) planes_.push_back({turn * hull_.planes[i].normal, hull_.planes[i].offset});
  turned_ = hull_;
  turned_.vertices = vertices_.data(), turned_.planes = planes_.data();
  turned_.vertex_eights = turned_.plane_eights = nullptr;
  for (int e = 0; 2 * e < turned_.edge_count; ++e) {
    const EdgeView edge = edge_view(turned_, e);
    edges_.push_back(
        {edge.from, edge.along, cross(edge.left, edge.along), cross(edge.right, edge.along), edge.left + edge.right});
  }
}

TriangleContact collide_triangle(const TriangleHull& triangle, const TurnedShape& shape, float margin,
                                 const Surroundings& surroundings) {
  // The shape's centre is the origin.
  if (triangle.planes[0].offset > 0.5f * shape.inner()) return {};
  TriangleContact contact = shape.is_round() ? TriangleContact{collide_round(triangle, shape, margin, surroundings)}
                                             : collide_polyhedron(triangle, shape, margin, surroundings);
  name_features(triangle, contact.manifold);
  return contact;
}

}  // namespace fathom
