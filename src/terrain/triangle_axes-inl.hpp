// The axes that separate triangles from a convex shape, for as many triangles as `Lanes` has lanes: one on a device,
// eight in registers. `Lanes` names its types, makes constants with `all` and combines masks; all other operations are
// overloaded. Pure, for host and device.
//
// A shape offers is_round(), round(), turned() (a box or a hull in the triangles' axes), edge_count() and edge(i).
#pragma once

#include "collision/hull_round.hpp"
#include "collision/tolerance.hpp"
#include "terrain/surface_triangle.hpp"

namespace fathom {

/// An edge of a polyhedron and its arc on the Gauss map, between the normals of its two faces.
struct EdgeArc {
  Vec3 from, along;
  Vec3 of_left, of_right;  ///< bounds of the arc: a normal on it is between these
  Vec3 middle;             ///< sum of the faces' normals
};
FATHOM_HD EdgeArc edge_arc(const HullView& shape, int k) {
  const EdgeView edge = edge_view(shape, k);
  return {edge.from, edge.along, cross(edge.left, edge.along), cross(edge.right, edge.along), edge.left + edge.right};
}

/// Triangles, their planes and edges.
template <class Lanes>
struct TriangleLanes {
  using Real = typename Lanes::Real;
  using Vec = typename Lanes::Vec;

  Vec corners[3], along[3], inward[3];
  Vec normals;
  Real offsets;
  Real squared_lengths[3];
  Real reach;  ///< largest coordinate (m)

  /// Completes the rest from corners and planes.
  FATHOM_HD void complete() {
    for (int k = 0; k < 3; ++k) {
      along[k] = corners[(k + 1) % 3] - corners[k];
      inward[k] = cross(normals, along[k]);
      squared_lengths[k] = length_squared(along[k]);
    }
    const auto largest = [](const Vec& v) { return max(abs(v.x), max(abs(v.y), abs(v.z))); };
    reach = max(largest(corners[0]), max(largest(corners[1]), largest(corners[2])));
  }
};

/// Where a point is relative to triangles: above their planes (m), over their insides, and its squared distances (m²).
template <class Lanes>
struct PointByTriangles {
  typename Lanes::Real heights, squares;
  typename Lanes::Mask over;

  FATHOM_HD PointByTriangles(const TriangleLanes<Lanes>& t, Vec3 point) {
    const typename Lanes::Vec at = Lanes::all(point);
    const typename Lanes::Real zero = Lanes::all(0.0f), one = Lanes::all(1.0f);
    heights = dot(t.normals, at) - t.offsets;
    over = dot(t.inward[0], at - t.corners[0]) >= zero;
    for (int k = 1; k < 3; ++k) over = Lanes::both(over, dot(t.inward[k], at - t.corners[k]) >= zero);
    typename Lanes::Real from_edges = Lanes::all(3e38f);
    for (int k = 0; k < 3; ++k) {
      const typename Lanes::Vec way = at - t.corners[k];
      const typename Lanes::Real s = max(zero, min(one, dot(way, t.along[k]) / t.squared_lengths[k]));
      from_edges = min(from_edges, length_squared(way - s * t.along[k]));
    }
    squares = Lanes::select(over, heights * heights, from_edges);
  }
};

/// The lowest heights of a polyhedron's vertices along directions.
template <class Lanes>
FATHOM_HD typename Lanes::Real lowest_along(const HullView& shape, const typename Lanes::Vec& directions) {
  typename Lanes::Real lowest = dot(directions, Lanes::all(shape.vertices[0]));
  for (int i = 1; i < shape.vertex_count; ++i) lowest = min(dot(directions, Lanes::all(shape.vertices[i])), lowest);
  return lowest;
}

/// Separations of the triangles from the shape's face f.
template <class Lanes>
FATHOM_HD typename Lanes::Real separation_from_face(const HullView& shape, int f, const TriangleLanes<Lanes>& t) {
  const typename Lanes::Vec n = Lanes::all(shape.planes[f].normal);
  const typename Lanes::Real lowest = min(dot(n, t.corners[0]), min(dot(n, t.corners[1]), dot(n, t.corners[2])));
  return lowest - Lanes::all(shape.planes[f].offset);
}

/// Results of the search, lane by lane.
template <class Lanes>
struct AxesOfTriangles {
  typename Lanes::Mask near;       ///< no axis separates them by more than the margin
  typename Lanes::Real of_normal;  ///< m, separation along the triangle's normal
  typename Lanes::Real of_face;    ///< m, along the normal of the shape's best face
  typename Lanes::Int face;
  /// Edges of the triangle and of the shape with the largest separation, if that exceeds the separation of all faces by
  /// more than the tolerance; else −1.
  typename Lanes::Int edge, edge_of_shape;
};

template <class Lanes>
struct FacesOfTriangles {
  typename Lanes::Real separations;
  typename Lanes::Int faces;
};

/// Per triangle, the shape's face with the largest separation.
template <class Lanes>
FATHOM_HD FacesOfTriangles<Lanes> best_faces(const HullView& shape, const TriangleLanes<Lanes>& t) {
  FacesOfTriangles<Lanes> best{Lanes::all(-3e38f), Lanes::all(-1)};
  for (int f = 0; f < shape.face_count; ++f) {
    const typename Lanes::Real separation = separation_from_face(shape, f, t);
    const typename Lanes::Mask better = separation > best.separations;
    best.separations = Lanes::select(better, separation, best.separations);
    best.faces = Lanes::select(better, Lanes::all(f), best.faces);
  }
  return best;
}

/// Edge pairs with the largest separation, if that is above a threshold.
template <class Lanes>
struct EdgesOfTriangles {
  typename Lanes::Real separations;
  typename Lanes::Int of_triangle, of_shape;
};

/// The normals of a triangle's edge are all directions across it that do not point into the triangle. The normals of a
/// hull's edge form an arc of the Gauss map between its two faces' normals. Most pairs have no normal in common, which
/// signs reveal before a square root is needed. Returns the triangles within the margin.
template <class Lanes, class Shape>
FATHOM_HD typename Lanes::Mask find_edges(const TriangleLanes<Lanes>& t, const Shape& shape, typename Lanes::Real noise,
                                          typename Lanes::Real margin, typename Lanes::Mask near,
                                          EdgesOfTriangles<Lanes>& best) {
  using Number = typename Lanes::Real;
  using Vec = typename Lanes::Vec;
  using Test = typename Lanes::Mask;
  const Number zero = Lanes::all(0.0f), one = Lanes::all(1.0f), shortest = Lanes::all(min_cross);
  for (int number = 0; number < shape.edge_count(); ++number) {
    const EdgeArc arc = shape.edge(number);
    const Vec along = Lanes::all(arc.along), left = Lanes::all(arc.of_left), right = Lanes::all(arc.of_right);
    for (int k = 0; k < 3; ++k) {
      const Vec across = cross(t.along[k], along);
      const Vec axis = Lanes::negated_where(dot(across, t.inward[k]) > zero, across);
      // It points into the shape and lies between the normals of its edge's faces.
      const Test between =
          Lanes::both(dot(axis, left) * dot(axis, right) <= zero, dot(axis, Lanes::all(arc.middle)) < zero);
      if (!Lanes::any(Lanes::both(between, near))) continue;
      const Number l = sqrt(length_squared(axis));
      const Vec normal = (one / l) * axis;
      const Number scaled_noise = noise * sqrt(t.squared_lengths[k] * Lanes::all(length_squared(arc.along))) / l;
      const Number separation = dot(normal, Lanes::all(arc.from) - t.corners[k]) - scaled_noise;
      const Test better = Lanes::both(between, Lanes::both(l > shortest, separation > best.separations));
      best.separations = Lanes::select(better, separation, best.separations);
      best.of_triangle = Lanes::select(better, Lanes::all(k), best.of_triangle);
      best.of_shape = Lanes::select(better, Lanes::all(number), best.of_shape);
      near = Lanes::without(near, Lanes::both(better, separation > margin));
    }
    if (!Lanes::any(near)) break;
  }
  return near;
}

/// Those of the triangles `near` whose plane and sides are within the margin of the round shape.
template <class Lanes>
FATHOM_HD typename Lanes::Mask near_of_round(TriangleLanes<Lanes>& t, const RoundShape& round, float margin,
                                             typename Lanes::Mask near) {
  using Number = typename Lanes::Real;
  const typename Lanes::Vec from = Lanes::all(round.core.from), end = Lanes::all(end_of(round.core));
  const Number reach = Lanes::all(round.radius + margin);
  near = Lanes::both(near, min(dot(t.normals, from) - t.offsets, dot(t.normals, end) - t.offsets) <= reach);
  if (!Lanes::any(near)) return near;
  t.complete();
  const Number beyond_rounding = Lanes::all(1.0001f) * reach;
  for (int k = 0; k < 3; ++k) {
    const Number inside = max(dot(t.inward[k], from - t.corners[k]), dot(t.inward[k], end - t.corners[k]));
    near =
        Lanes::both(near, Lanes::either(inside >= Lanes::all(0.0f),
                                        inside * inside <= beyond_rounding * beyond_rounding * t.squared_lengths[k]));
  }
  return near;
}

/// How far (m) behind each triangle the shape's centre may be.
template <class Lanes, class Shape>
FATHOM_HD typename Lanes::Real allowed_behind(const TriangleLanes<Lanes>& t, const Shape& shape, const Vec3* pushed,
                                              int pushes) {
  const typename Lanes::Real on_that_side = Lanes::all(0.5f);  // normals within 60 degrees
  typename Lanes::Real allowed = Lanes::all(0.5f * shape.inner());
  for (int i = 0; i < pushes; ++i)
    allowed = Lanes::select(dot(t.normals, Lanes::all(pushed[i])) > on_that_side, Lanes::all(shape.outer()), allowed);
  return allowed;
}

/// The first part of the search, for the triangles `present`, of which corners and planes are set: all axes but those
/// across two edges; for a round shape all axes.
///
/// A triangle is not near if the shape's centre is behind its front by more than half the shape's inner radius. The
/// shape then counts as coming from behind, as it may if the surface is open. A shape that the surface already pushes
/// along one of `pushed` (unit) came from the front and may penetrate by its whole size. `margin` in m.
template <class Lanes, class Shape>
FATHOM_HD AxesOfTriangles<Lanes> face_axes_of(TriangleLanes<Lanes>& t, typename Lanes::Mask present, const Shape& shape,
                                              float margin, const Vec3* pushed, int pushes) {
  AxesOfTriangles<Lanes> axes{};
  axes.near = Lanes::both(present, t.offsets <= allowed_behind(t, shape, pushed, pushes));
  if (shape.is_round()) {
    axes.near = near_of_round(t, shape.round(), margin, axes.near);
    return axes;
  }
  margin += shape.turned().radius;
  axes.of_normal = lowest_along<Lanes>(shape.turned(), t.normals) - t.offsets;
  axes.near = Lanes::both(axes.near, axes.of_normal <= Lanes::all(margin));
  if (!Lanes::any(axes.near)) return axes;
  const FacesOfTriangles<Lanes> faces = best_faces(shape.turned(), t);
  axes.of_face = faces.separations, axes.face = faces.faces;
  axes.near = Lanes::both(axes.near, faces.separations <= Lanes::all(margin));
  return axes;
}

/// The rest of the search, for a box or a hull.
template <class Lanes, class Shape>
FATHOM_HD void add_edge_axes(TriangleLanes<Lanes>& t, const Shape& shape, float margin, AxesOfTriangles<Lanes>& axes) {
  using Number = typename Lanes::Real;
  t.complete();
  margin += shape.turned().radius;
  // As `make_tolerance`.
  const Number reach = t.reach + Lanes::all(shape.outer());
  const Number tolerance =
      min(Lanes::all(max_axis_tolerance), Lanes::all(axis_tolerance_share) * min(t.reach, Lanes::all(shape.inner()))) +
      Lanes::all(axis_rounding) * reach;
  EdgesOfTriangles<Lanes> edges{max(axes.of_normal, axes.of_face) + tolerance, Lanes::all(-1), Lanes::all(-1)};
  axes.near = find_edges(t, shape, Lanes::all(separation_rounding) * reach, Lanes::all(margin), axes.near, edges);
  axes.edge = edges.of_triangle, axes.edge_of_shape = edges.of_shape;
}

/// One triangle.
struct OneLane {
  using Real = float;
  using Int = std::int32_t;
  using Vec = Vec3;
  using Mask = bool;

  FATHOM_HD static float all(float x) { return x; }
  FATHOM_HD static std::int32_t all(std::int32_t x) { return x; }
  FATHOM_HD static Vec3 all(Vec3 v) { return v; }
  FATHOM_HD static bool any(bool m) { return m; }
  FATHOM_HD static bool both(bool a, bool b) { return a && b; }
  FATHOM_HD static bool either(bool a, bool b) { return a || b; }
  FATHOM_HD static bool without(bool a, bool b) { return a && !b; }
  template <class T>
  FATHOM_HD static T select(bool m, T a, T b) {
    return m ? a : b;
  }
  FATHOM_HD static Vec3 negated_where(bool m, Vec3 v) { return m ? -v : v; }
};

/// Corners and planes only (`complete`).
FATHOM_HD TriangleLanes<OneLane> begin_lane(const SurfaceTriangle& triangle) {
  TriangleLanes<OneLane> t;
  for (int k = 0; k < 3; ++k) t.corners[k] = triangle.corners[k];
  t.normals = triangle.normal, t.offsets = triangle.offset;
  return t;
}

FATHOM_HD AxesOfTriangles<OneLane> axes_of(const SurfaceTriangle& triangle, const auto& shape, float margin,
                                           const Vec3* pushed, int pushes) {
  TriangleLanes<OneLane> t = begin_lane(triangle);
  AxesOfTriangles<OneLane> axes = face_axes_of(t, true, shape, margin, pushed, pushes);
  if (axes.near && !shape.is_round()) add_edge_axes(t, shape, margin, axes);
  return axes;
}

}  // namespace fathom
