// Contact manifold of two hulls: the axis of least overlap, then clipped faces or crossing edges.
//
// The order of preference is that of boxes (box_box.hpp): faces before edges, A before B, last step's face before
// others.
#pragma once

#include "collision/cache.hpp"
#include "collision/clip.hpp"
#include "collision/closest.hpp"
#include "collision/hull_axes.hpp"
#include "collision/strip.hpp"

namespace fathom {

/// Two hulls in each other's frames.
struct HullPair {
  HullView a, b;
  Frame b_in_a, a_in_b;
  Tolerance tolerance;
  float slack;  ///< see `height_slack`
};

FATHOM_HD HullPair make_hull_pair(const HullView& a, const HullView& b, const Pose& b_in_a) {
  const Frame frame = make_frame(b_in_a);
  const HullSize size_a = size_of(a), size_b = size_of(b);
  const float reach = size_a.outer + size_b.outer + max_component(abs(b_in_a.position));
  return {a, b, frame, inverse(frame), make_tolerance(min(size_a.inner, size_b.inner), reach), height_slack(reach)};
}

/// The face of `inc` most opposed to `normal`, among those around the vertex that is lowest along it: the deepest point
/// is then on that face.
FATHOM_HD int incident_face(const HullView& inc, Vec3 normal) {
  const int vertex = lowest_vertex(inc, normal).vertex;
  int start = inc.vertex_edges ? inc.vertex_edges[vertex] : 0;
  while (inc.edges[start].origin != vertex) ++start;
  int best = inc.edges[start].face;
  float best_dot = dot(inc.planes[best].normal, normal);
  int e = start;
  do {
    e = inc.edges[e ^ 1].next;
    const int face = inc.edges[e].face;
    const float d = dot(inc.planes[face].normal, normal);
    if (d < best_dot) best = face, best_dot = d;
  } while (e != start);
  return best;
}

/// The side of the incident face that the shape's centre is farthest beyond or, if it is inside, nearest to; with its
/// ends.
struct NearestSide {
  int edge;
  FacePoint from, to;
};
FATHOM_HD NearestSide nearest_side(const HullView& inc, const Frame& inc_in_ref, int inc_face, const FaceFrame& frame) {
  const FacePoint centre = to_face(frame, inc_in_ref.position, 0);
  const auto corner = [&](int e) {
    return to_face(frame, transform(inc_in_ref, inc.vertices[inc.edges[e].origin]), 0);
  };
  NearestSide nearest{};
  float least = 3e38f;
  int e = inc.face_edges[inc_face];
  FacePoint from = corner(e);
  do {
    const int next = inc.edges[e].next;
    const FacePoint to = corner(next);
    const float dx = to.x - from.x, dy = to.y - from.y;
    // The incident face faces the other way: its corners run clockwise.
    const float inside = -area(from, to, centre) / fathom::sqrt(fma(dx, dx, dy * dy));
    if (inside < least) least = inside, nearest = {e, from, to};
    e = next, from = to;
  } while (e != inc.face_edges[inc_face]);
  return nearest;
}

/// Adds to the `count` points of the incident face the corner onto which the shape would tip: the farthest corner of
/// the face beyond the nearest side, if it is over the reference face and not higher than `margin` (m). Small or thin
/// shapes tip over a side within a step, where no contact would hold them. Returns the new number of points.
FATHOM_HD int add_next_corner(const HullView& ref, int ref_face, const HullView& inc, const Frame& inc_in_ref,
                              int inc_face, const FaceFrame& frame, float side_tolerance, float margin, bool flipped,
                              FacePoint* points, int count) {
  const NearestSide side = nearest_side(inc, inc_in_ref, inc_face, frame);
  const int beyond = side.edge ^ 1;
  FacePoint next{};
  float farthest = 0;
  for (int e = inc.edges[inc.edges[beyond].next].next; e != beyond; e = inc.edges[e].next) {
    const int vertex = inc.edges[e].origin;
    const FacePoint corner = to_face(frame, transform(inc_in_ref, inc.vertices[vertex]),
                                     vertex_feature(static_cast<std::uint32_t>(vertex), !flipped));
    const float out = area(side.from, side.to, corner);
    if (out > farthest) farthest = out, next = corner;
  }
  if (!(farthest > 0) || next.z > margin) return count;
  int e = ref.face_edges[ref_face];
  do {
    if (distance_to(make_side(ref, frame, e, side_tolerance), next) > 0) return count;
    e = ref.edges[e].next;
  } while (e != ref.face_edges[ref_face]);
  points[count] = next;
  return count + 1;
}

/// Up to four points over a face of A, or if `flipped` of B.
FATHOM_HD void hull_face_contact(const HullPair& p, int face, bool flipped, float margin, const PatchLoad& load,
                                 AxisCache& cache, Manifold& manifold) {
  const HullView& ref = flipped ? p.b : p.a;
  const HullView& inc = flipped ? p.a : p.b;
  const Frame& inc_in_ref = flipped ? p.a_in_b : p.b_in_a;
  const FaceFrame frame = make_face_frame(ref.planes[face]);
  const int other_face = incident_face(inc, transpose_mul(inc_in_ref.rotation, frame.n));

  FacePoint points[max_face_points];
  int clipped =
      clip_hull_faces(ref, face, inc, inc_in_ref, other_face, frame, p.tolerance.side, margin, flipped, points);
  if (clipped > 0 && clipped < max_manifold_points)
    clipped = add_next_corner(ref, face, inc, inc_in_ref, other_face, frame, p.tolerance.side, margin, flipped, points,
                              clipped);
  manifold.normal = flipped ? -(p.b_in_a.rotation * frame.n) : frame.n;
  cache.reduced = clipped > max_manifold_points;
  FaceLoad at;
  if (load.is_known && cache.reduced) {
    const Vec3 in_ref = flipped ? transform(p.a_in_b, load.at) : load.at;
    at = {dot(in_ref, frame.x), dot(in_ref, frame.y), true};
  }
  manifold.count = reduce(points, clipped, p.tolerance.depth_tie, at);
  for (int i = 0; i < manifold.count; ++i) {
    const Vec3 position = from_face(frame, points[i].x, points[i].y, 0.5f * points[i].z);
    manifold.points[i].position = flipped ? transform(p.b_in_a, position) : position;
    manifold.points[i].separation = points[i].z;
    manifold.points[i].feature = points[i].feature;
  }
}

/// One point where the edges cross.
FATHOM_HD void hull_edge_contact(const HullPair& p, const EdgesAxis& axis, float margin, Manifold& manifold) {
  const EdgeView a = edge_view(p.a, axis.a), b = transform(p.b_in_a, edge_view(p.b, axis.b));
  const SegmentPair closest = closest_points({a.from, a.along}, {b.from, b.along});
  const float separation = dot(axis.normal, b.from - a.from);
  // Ends of edges may be farther apart than the planes between them.
  if (separation > 0 && length_squared(closest.on_2 - closest.on_1) > margin * margin) return;
  manifold.normal = axis.normal;
  manifold.count = 1;
  manifold.points[0].position = 0.5f * (closest.on_1 + closest.on_2);
  manifold.points[0].separation = separation;
  manifold.points[0].feature =
      edge_feature(static_cast<std::uint32_t>(axis.a), static_cast<std::uint32_t>(axis.b), false);
}

/// One point at the vertex of B that is deepest under a face of A, or if `flipped` the other way round.
FATHOM_HD void hull_vertex_contact(const HullPair& p, int face, bool flipped, Manifold& manifold) {
  const HullView& ref = flipped ? p.b : p.a;
  const HullView& inc = flipped ? p.a : p.b;
  const Frame& inc_in_ref = flipped ? p.a_in_b : p.b_in_a;
  const Hull::Plane plane = ref.planes[face];
  const int vertex = lowest_vertex(inc, transpose_mul(inc_in_ref.rotation, plane.normal)).vertex;
  const Vec3 point = transform(inc_in_ref, inc.vertices[vertex]);
  const float height = plane_height(plane, point);
  const Vec3 position = mul_add(point, -0.5f * height, plane.normal);
  manifold.count = 1;
  manifold.normal = flipped ? -(p.b_in_a.rotation * plane.normal) : plane.normal;
  manifold.points[0].position = flipped ? transform(p.b_in_a, position) : position;
  manifold.points[0].separation = height;
  manifold.points[0].feature = vertex_feature(static_cast<std::uint32_t>(vertex), !flipped);
}

/// The pair of edges with the largest separation above `threshold`, if any. Ends early where that exceeds `margin`.
/// `of_a` and `of_b` are witnesses of each hull in the other's frame.
FATHOM_HD EdgesAxis best_edges(const HullPair& p, const Witnesses& of_a, const Witnesses& of_b, float threshold,
                               float margin) {
  const NearEdges near_a(p.a, of_b, threshold, p.slack), near_b(p.b, of_a, threshold, p.slack);
  return best_edges(p.a, p.b, p.b_in_a, near_a, near_b, p.tolerance.noise, threshold, margin);
}

/// See `collide`.
FATHOM_HD Manifold collide_hulls(const HullView& a, const HullView& b, const Pose& b_in_a, float margin,
                                 AxisCache& cache, const PatchLoad& load) {
  Manifold manifold;
  const HullPair p = make_hull_pair(a, b, b_in_a);
  if (cache.separated && cached_separation(a, b, p.b_in_a, p.a_in_b, p.tolerance.noise, cache) > margin)
    return manifold;

  Witnesses of_a, of_b;  // each in the other's frame
  const int start_a = cache.kind == AxisCache::face_a && cache.a < a.face_count ? cache.a : facing(a, b_in_a.position);
  const FaceAxis face_a = best_face(a, b, p.b_in_a, start_a, p.slack, margin, of_b);
  if (face_a.separation > margin) {
    cache = make_cache(AxisCache::face_a, face_a.face, 0, true);
    return manifold;
  }
  const Vec3 back = -transpose_mul(p.b_in_a.rotation, a.planes[face_a.face].normal);
  const int start_b = cache.kind == AxisCache::face_b && cache.b < b.face_count ? cache.b : facing(b, back);
  const FaceAxis face_b = best_face(b, a, p.a_in_b, start_b, p.slack, margin, of_a);
  if (face_b.separation > margin) {
    cache = make_cache(AxisCache::face_b, 0, face_b.face, true);
    return manifold;
  }

  const float face_separation = max(face_a.separation, face_b.separation), tolerance = p.tolerance.axis;
  const float edge_threshold = face_separation + (cache.kind == AxisCache::edges ? 0.5f * tolerance : tolerance);
  bool flipped = face_b.separation > face_a.separation + tolerance;
  int face = flipped ? face_b.face : face_a.face;
  const EdgesAxis edges = best_edges(p, of_a, of_b, min(edge_threshold, margin), margin);
  if (edges.separation > margin) {
    cache = make_cache(AxisCache::edges, edges.a, edges.b, true);
    return manifold;
  }
  const bool by_edges = edges.a >= 0;
  if (by_edges) {
    cache = make_cache(AxisCache::edges, edges.a, edges.b, false);
    hull_edge_contact(p, edges, margin, manifold);
    if (!may_be_strip(manifold, flipped ? -(p.b_in_a.rotation * b.planes[face].normal) : a.planes[face].normal))
      return manifold;
  } else {
    const bool cached_face = cache.kind == AxisCache::face_a || cache.kind == AxisCache::face_b;
    if (cached_face &&
        cached_separation(a, b, p.b_in_a, p.a_in_b, p.tolerance.noise, cache) + tolerance > face_separation) {
      flipped = cache.kind == AxisCache::face_b;
      face = flipped ? cache.b : cache.a;
    }
    cache = flipped ? make_cache(AxisCache::face_b, 0, face, false) : make_cache(AxisCache::face_a, face, 0, false);
  }
  // A single call for both: kernel compilers would inline it twice.
  Manifold strip;
  AxisCache of_strip;
  hull_face_contact(p, face, flipped, margin, by_edges ? PatchLoad{} : load, by_edges ? of_strip : cache,
                    by_edges ? strip : manifold);
  if (by_edges) {
    widen_to_strip(strip, margin, tolerance, manifold);
    return manifold;
  }
  if (hides_overlap(manifold, face_separation, tolerance)) {
    const EdgesAxis nearest = best_edges(p, of_a, of_b, face_separation - tolerance, margin);
    if (nearest.a >= 0) {
      hull_edge_contact(p, nearest, margin, manifold);
    } else {
      hull_vertex_contact(p, face, flipped, manifold);
    }
  }
  return manifold;
}

}  // namespace fathom
