// A hull against a sphere or a capsule.
//
// The core of the round shape is a segment. While it is outside the hull, the closest features are found exactly and
// define the normal; once it is inside, the axis of least overlap decides: face normals, and cross products of the
// segment with the edges whose arc of normals crosses the great circle perpendicular to it.
#pragma once

#include "collision/cache.hpp"
#include "collision/closest.hpp"
#include "collision/feature.hpp"
#include "collision/hull_axes.hpp"
#include "collision/round_shapes.hpp"

namespace fathom {

/// Closest points of a hull and a segment outside it.
struct HullSegment {
  float distance_squared = 3e38f;
  Vec3 on_hull, on_segment;
  std::uint32_t feature = 0;

  /// Takes these points if they are nearer.
  FATHOM_HD void offer(Vec3 of_hull, Vec3 of_segment, std::uint32_t name) {
    const float squared = length_squared(of_segment - of_hull);
    if (squared < distance_squared) *this = {squared, of_hull, of_segment, name};
  }
};

FATHOM_HD Vec3 end_of(const Segment& s) { return s.from + s.along; }

FATHOM_HD float face_separation(const Hull::Plane& plane, const Segment& s) {
  return min(plane_height(plane, s.from), plane_height(plane, end_of(s)));
}

#if defined(FATHOM_HAS_EIGHT)
/// `best_face` in blocks of eight.
FATHOM_HD FaceAxis best_face_by_eights(const HullView& hull, const Segment& s) {
  const EightVec3 from = eight(s.from), end = eight(end_of(s));
  const EightInts count = lane_numbers();
  Eight highest = eight(no_separation);
  EightInts face = count;
  for (int f = 0; f < hull.face_count; f += 8) {
    const EightPlanes planes = planes_at(hull, f);
    const Eight separation = min(plane_height(planes, from), plane_height(planes, end));
    const EightInts higher = separation > highest;
    highest = select(higher, separation, highest);
    face = select(higher, count + f, face);
  }
  const LeastLane least = min_lane(-highest, face);
  return {least.index, -least.value + 0.0f};
}
#endif

/// The face over which the segment is highest; the first of equals.
FATHOM_HD FaceAxis best_face(const HullView& hull, const Segment& s) {
#if defined(FATHOM_HAS_EIGHT)
  if (by_eights(hull)) return best_face_by_eights(hull, s);
#endif
  FaceAxis best;
  for (int f = 0; f < hull.face_count; ++f) {
    const float separation = face_separation(hull.planes[f], s);
    if (separation > best.separation) best = {f, separation};
  }
  best.separation += 0.0f;
  return best;
}

/// The edge with the largest separation across it and the segment above `threshold`, if any.
FATHOM_HD EdgesAxis best_edges(const HullView& hull, const Segment& s, const Witnesses& ends, float noise,
                               float threshold, float slack) {
  EdgesAxis best;
  best.separation = threshold;
  if (!(length_squared(s.along) > 0)) return best;
  const NearEdges near(hull, ends, threshold, slack);
  for (int i = 0; i < near.count; ++i) {
    const EdgeView e = edge_view(hull, near.edges[i]);
    if (!(dot(e.left, s.along) * dot(e.right, s.along) < 0)) continue;
    const EdgesAxis axis = edges_axis(e, {s.from, s.along, {}, {}}, noise);
    if (axis.separation > best.separation) best = {near.edges[i], 0, axis.separation, axis.normal};
  }
  return best;
}

/// The part lo ≤ t ≤ hi of the segment over a face, and the half-edges that bound it (−1: none).
struct Stretch {
  float lo = 0, hi = 1;
  int lo_edge = -1, hi_edge = -1;

  FATHOM_HD bool empty() const { return lo > hi; }
};
FATHOM_HD Stretch clip_segment(const HullView& hull, int face, const Segment& s, float side_tolerance) {
  Stretch stretch;
  const Vec3 normal = hull.planes[face].normal;
  int e = hull.face_edges[face];
  do {
    const Vec3 from = hull.vertices[hull.edges[e].origin];
    const Vec3 along = hull.vertices[hull.edges[e ^ 1].origin] - from;
    const Vec3 outward = cross(along, normal);
    const float outside = dot(outward, s.from - from) - side_tolerance * length(along), rate = dot(outward, s.along);
    const float t = -outside / rate;
    if (rate > 0) {
      if (t < stretch.hi) stretch.hi = t, stretch.hi_edge = e;
    } else if (rate < 0) {
      if (t > stretch.lo) stretch.lo = t, stretch.lo_edge = e;
    } else if (outside > 0) {
      stretch.lo = 2;
    }
    e = hull.edges[e].next;
  } while (e != hull.face_edges[face]);
  return stretch;
}

FATHOM_HD std::uint32_t segment_feature(float t, int edge) {
  if (t <= 0) return vertex_feature(0, true);
  if (t >= 1) return vertex_feature(1, true);
  return edge_feature(static_cast<std::uint32_t>(edge), 0, false);
}

/// Offers the pair of closest points of the segment and the hull's undirected edge.
FATHOM_HD void offer_edge(const HullView& hull, int edge, const Segment& s, HullSegment& best) {
  const Vec3 from = hull.vertices[hull.edges[2 * edge].origin];
  const SegmentPair pair = closest_points({from, hull.vertices[hull.edges[2 * edge + 1].origin] - from}, s);
  best.offer(pair.on_1, pair.on_2, segment_feature(pair.t, edge));
}

/// Whether no points of the hull and the segment are nearer by more than `slack` (m): neither reaches further along
/// their connection.
FATHOM_HD bool is_closest(const HullView& hull, const Segment& s, const HullSegment& pair, float slack) {
  const Vec3 d = pair.on_segment - pair.on_hull;
  const float off = slack * fathom::sqrt(pair.distance_squared);
  if (min(dot(d, s.from - pair.on_segment), dot(d, end_of(s) - pair.on_segment)) < -off) return false;
  return highest_vertex(hull, d).height - dot(d, pair.on_hull) <= off;
}

/// The same by a search that is exhaustive over the features that the segment's ends can see; edges cover the vertices.
/// The closest feature lies on a face that some end sees, because the direction to it is a combination of such faces'
/// normals.
FATHOM_HD HullSegment closest_of_seen(const HullView& hull, const Segment& s, const Witnesses& ends, float slack) {
  HullSegment best;
  const SeenFaces seen(hull, ends, -slack);
  for (int n = 0; n < seen.count; ++n) {
    const int f = seen.faces[n];
    for (int i = 0; i < 2; ++i) {
      const Vec3 point = i == 0 ? s.from : end_of(s);
      const float height = plane_height(hull.planes[f], point);
      if (height < 0 || height * height > best.distance_squared) continue;
      if (clip_segment(hull, f, {point, {}}, 0).empty()) continue;
      best.offer(mul_add(point, -height, hull.planes[f].normal), point,
                 vertex_feature(static_cast<std::uint32_t>(i), true));
    }
  }
  for (int n = 0; n < seen.count; ++n) {
    const int f = seen.faces[n];
    int e = hull.face_edges[f];
    do {
      const bool is_others = e % 2 == 1 && seen.by[hull.edges[e ^ 1].face] != 0;
      if (!is_others) offer_edge(hull, e >> 1, s, best);
      e = hull.edges[e].next;
    } while (e != hull.face_edges[f]);
  }
  return best;
}

/// `highest` is the face over which the segment is highest. Nothing is nearer than that, so a segment end over the face
/// itself is closest. Otherwise it is mostly an edge of that face.
FATHOM_HD HullSegment closest_outside(const HullView& hull, const Segment& s, const FaceAxis& highest,
                                      const Witnesses& ends, float slack) {
  HullSegment best;
  const Hull::Plane plane = hull.planes[highest.face];
  const float height_from = plane_height(plane, s.from), height_end = plane_height(plane, end_of(s));
  const bool from_is_lower = height_from <= height_end;
  const Vec3 lower = from_is_lower ? s.from : end_of(s);
  if (min(height_from, height_end) > 0 && !clip_segment(hull, highest.face, {lower, {}}, 0).empty()) {
    best.offer(mul_add(lower, -min(height_from, height_end), plane.normal), lower,
               vertex_feature(from_is_lower ? 0 : 1, true));
    return best;
  }
  int e = hull.face_edges[highest.face];
  do {
    offer_edge(hull, e >> 1, s, best);
    e = hull.edges[e].next;
  } while (e != hull.face_edges[highest.face]);
  return is_closest(hull, s, best, slack) ? best : closest_of_seen(hull, s, ends, slack);
}

/// Adds the first `count` ends of the core's stretch over the face, if they are not higher than `reach`.
FATHOM_HD void add_stretch(const HullView& hull, int face, const Stretch& stretch, const RoundShape& round, int count,
                           float reach, Manifold& m) {
  const Hull::Plane& plane = hull.planes[face];
  for (int i = 0; i < count; ++i) {
    const float t = i == 0 ? stretch.lo : stretch.hi;
    const Vec3 on_core = mul_add(round.core.from, t, round.core.along);
    const float height = plane_height(plane, on_core);
    if (height > reach) continue;
    const int edge = i == 0 ? stretch.lo_edge : stretch.hi_edge;
    add_round_point(m, mul_add(on_core, -height, plane.normal), hull.radius, height, round.radius,
                    segment_feature(t, edge >> 1));
  }
}

/// Adds one or two points where the core runs over the face, not higher than `reach`. Adds none if the lowest is not at
/// the height `expected`: then the closest feature is not the face, or lies in another direction.
FATHOM_HD void add_face_points(const HullView& hull, int face, const RoundShape& round, const Tolerance& tolerance,
                               float expected, float reach, Manifold& m) {
  const Hull::Plane& plane = hull.planes[face];
  const Stretch stretch = clip_segment(hull, face, round.core, tolerance.side);
  if (stretch.empty()) return;
  const Vec3 from = mul_add(round.core.from, stretch.lo, round.core.along);
  const Vec3 to = mul_add(round.core.from, stretch.hi, round.core.along);
  if (abs(min(plane_height(plane, from), plane_height(plane, to)) - expected) > tolerance.axis) return;
  m.normal = plane.normal;
  const bool one = length_squared(to - from) <= tolerance.side * tolerance.side;
  add_stretch(hull, face, stretch, round, one ? 1 : 2, reach, m);
}

/// Hull A and a round shape given in A's frame. In the cache, `kind` face_a stands for a face of the hull.
FATHOM_HD Manifold collide_hull_round(const HullView& hull, const RoundShape& round, float margin, AxisCache& cache) {
  Manifold m;
  const Segment& core = round.core;
  const float reach = hull.radius + round.radius + margin;
  if (cache.separated && cache.a < hull.face_count && face_separation(hull.planes[cache.a], core) > reach) return m;

  const FaceAxis face = best_face(hull, core);
  cache = make_cache(AxisCache::face_a, face.face, 0, face.separation > reach);
  if (face.separation > reach) return m;

  const HullSize size = size_of(hull);
  const float extent = size.outer + max_component(abs(core.from)) + max_component(abs(core.along));
  const Tolerance tolerance = make_tolerance(min(size.inner, round.radius), extent);
  const float slack = height_slack(extent);
  Witnesses ends;
  ends.add(core.from), ends.add(end_of(core));
  // The closest points give no direction for a core that almost touches the hull; the axes do.
  EdgesAxis edges;
  if (!(face.separation > tolerance.depth_tie))
    edges = best_edges(hull, core, ends, tolerance.noise, face.separation, slack);
  if (max(face.separation, edges.separation) > tolerance.depth_tie) {
    const HullSegment closest = closest_outside(hull, core, face, ends, slack);
    const float gap = fathom::sqrt(closest.distance_squared);
    if (gap > reach) return m;
    add_face_points(hull, face.face, round, tolerance, gap, reach, m);
    if (m.count == 0) {
      m.normal = (1.0f / gap) * (closest.on_segment - closest.on_hull);
      add_round_point(m, closest.on_hull, hull.radius, gap, round.radius, closest.feature);
    }
    return m;
  }

  if (edges.separation > face.separation + tolerance.axis) {
    const EdgeView e = edge_view(hull, edges.a);
    const SegmentPair pair = closest_points({e.from, e.along}, core);
    m.normal = edges.normal;
    add_round_point(m, pair.on_1, hull.radius, dot(m.normal, core.from - e.from), round.radius,
                    segment_feature(pair.t, edges.a));
    return m;
  }
  add_face_points(hull, face.face, round, tolerance, face.separation, reach, m);
  if (m.count == 0) {
    // The deepest end is beside the face.
    const Hull::Plane& plane = hull.planes[face.face];
    const std::uint32_t lower = plane_height(plane, core.from) <= plane_height(plane, end_of(core)) ? 0 : 1;
    const Vec3 end = lower == 0 ? core.from : end_of(core);
    m.normal = plane.normal;
    add_round_point(m, mul_add(end, -face.separation, plane.normal), hull.radius, face.separation, round.radius,
                    vertex_feature(lower, true));
  }
  return m;
}

}  // namespace fathom
