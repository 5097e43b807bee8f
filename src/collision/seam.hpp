// Seams: shapes that lie side by side throughout a step, such as tiles, collide as one surface.
//
// Each pair of shapes is collided separately. A body that slides over two tiles would get a contact with the side of
// the next one, which the previous tile hides, and a ball a contact with that tile's edge, tilted against its motion.
// So a manifold at an edge of a shape is compared with the neighbours:
//
// * A normal counts where no neighbour rises above the plane across it: it is a normal of both shapes' union.
// * Otherwise a face normal counts where that face is visible. In the corner between a floor and a wall that stands
//   on it both normals count; the side of a tile beside another one is hidden.
// * A manifold that does not count is replaced by the one over the least deeply touched of the visible faces, if the
//   other shape is over it; otherwise the neighbour holds it.
//
// Where shapes move against each other, only what is hidden as the step begins and as it ends does not count: a belt
// that runs beside the floor continues it, but a lift that leaves the floor is a step.
//
// Triangles of a mesh (terrain/) follow the same rule, with precomputed edges. Pure, for host and device.
#pragma once

#include "collision/collide.hpp"
#include "geometry/support.hpp"

namespace fathom {

/// Tolerances (m) of a seam.
struct SeamLengths {
  float gap;              ///< ignored gap between neighbours, or difference in height
  float step;             ///< from a point to the positions around it that are tested for visibility
  float edge;             ///< distance from an edge beyond which no seam is looked for
  float deepest = 3e38f;  ///< depth up to which a face replaces a manifold that does not count

  /// For a touched child of a body that can be pushed, twice `half` thick. B may be a wall, which reaches far under
  /// faces of the child that its centre happens to be in front of; these are no way out.
  FATHOM_HD void limit_depth(float half) { deepest = 2 * half; }
};

/// For a touching shape twice `half` thick (m), with coordinates of at most `extent`.
FATHOM_HD SeamLengths make_seam_lengths(float half, float extent) {
  const float gap = min(1e-3f, 0.02f * half) + 4e-7f * extent;
  return {gap, 2 * gap, 0.25f * half + 2 * gap};
}

/// For B, twice `half_b` thick (m), on A at its pose.
FATHOM_HD SeamLengths make_seam_lengths(float half_b, float radius_a, float radius_b, const Pose& b_in_a,
                                        const Pose& pose_a) {
  const float extent = min(radius_a, length(b_in_a.position) + radius_b);
  return make_seam_lengths(half_b, max(extent, 0.25f * max_component(abs(pose_a.position))));
}

/// Boxes and hulls have faces that may be hidden, and may hide others'. Between rounded ones there are grooves.
FATHOM_HD bool has_faces(const Geometry& g) {
  return (g.type == ShapeType::box || g.type == ShapeType::hull) && g.radius == 0;
}

/// Height of a point, in the shape's frame, over the face where it is greatest; below zero: inside.
FATHOM_HD float height_over(const Geometry& g, Vec3 point) {
  if (g.type == ShapeType::box) return max_component(abs(point) - g.half_extents);
  float highest = no_separation;
  for (int f = 0; f < g.hull.face_count; ++f) highest = max(highest, plane_height(g.hull.planes[f], point));
  return highest;
}

/// Whether two of its faces are closer than `edge` to a point on its surface.
FATHOM_HD bool is_at_edge(const Geometry& g, Vec3 point, float edge) {
  int near = 0;
  if (g.type == ShapeType::box) {
    const Vec3 depth = g.half_extents - abs(point);
    near = (depth.x < edge) + (depth.y < edge) + (depth.z < edge);
  } else {
    for (int f = 0; f < g.hull.face_count && near < 2; ++f) near += plane_height(g.hull.planes[f], point) > -edge;
  }
  return near > 1;
}

/// Whether the unit vector is the normal of a face.
FATHOM_HD bool is_face_normal(const Geometry& g, Vec3 normal) {
  constexpr float same = 1 - 1e-6f;
  if (g.type == ShapeType::box) return max_component(abs(normal)) > same;
  for (int f = 0; f < g.hull.face_count; ++f)
    if (dot(g.hull.planes[f].normal, normal) > same) return true;
  return false;
}

/// A box or a hull beside the touched shape, in the frame of the latter.
struct NeighbourSolid {
  Geometry shape;
  Pose pose;

  /// Whether the point is inside, or at most `gap` (m) outside.
  FATHOM_HD bool holds(Vec3 point, float gap) const {
    return height_over(shape, inverse_transform(pose, point)) <= gap;
  }
  /// Calls act(plane) for faces in front of which the point lies, in the frame of the touched shape, until it returns
  /// true; returns whether it did.
  template <class Act>
  FATHOM_HD bool any_face_before(Vec3 point, const Act& act) const {
    const bool is_box = shape.type == ShapeType::box;
    for (int f = 0; f < (is_box ? 6 : shape.hull.face_count); ++f) {
      Hull::Plane plane;
      if (is_box) {
        const float side = f % 2 == 0 ? 1.0f : -1.0f;
        plane = {{f / 2 == 0 ? side : 0, f / 2 == 1 ? side : 0, f / 2 == 2 ? side : 0}, shape.half_extents[f / 2]};
      } else {
        plane = shape.hull.planes[f];
      }
      plane.normal = rotate(pose.rotation, plane.normal);
      plane.offset += dot(plane.normal, pose.position);
      if (plane_height(plane, point) > 0 && act(plane)) return true;
    }
    return false;
  }
  /// Height (m) to which it rises above the plane across `normal` through the point.
  FATHOM_HD float rise(Vec3 point, Vec3 normal) const {
    const Vec3 direction = inverse_rotate(pose.rotation, normal);
    return dot(direction, support(shape, direction) - inverse_transform(pose, point));
  }
};

/// Point on the surface of A.
FATHOM_HD Vec3 on_first(const Manifold& m, int i) {
  return mul_add(m.points[i].position, -0.5f * m.points[i].separation, m.normal);
}

/// Whether the manifold, in A's frame, is near an edge and therefore may not count.
FATHOM_HD bool may_be_at_seam(const Geometry& a, const Manifold& m, const SeamLengths& lengths) {
  if (!has_faces(a)) return false;
  bool at_edge = false;
  for (int i = 0; i < m.count; ++i) at_edge |= is_at_edge(a, on_first(m, i), lengths.edge);
  return at_edge;
}

/// Whether a neighbour near the point rises above the plane across the normal.
template <class Neighbour>
FATHOM_HD bool rises_at(const Neighbour& neighbour, Vec3 point, Vec3 normal, float gap) {
  constexpr float flat = 0.02f;  // face normals are judged by visibility
  constexpr float near = 4;      // points may lie slightly beside the edge
  return neighbour.holds(point, near * gap) && neighbour.rise(point, normal) > flat * gap;
}

/// `Neighbours`, at one moment: any(act) returns whether act(neighbour) is true for any.
template <class Neighbours>
FATHOM_HD bool rises_beside(const Neighbours& neighbours, Vec3 point, Vec3 normal, float gap) {
  return neighbours.any([&](const auto& n) { return rises_at(n, point, normal, gap); });
}

/// Whether the face of A with this normal is visible around a point on it, or beside a neighbour that hides it there,
/// if B with this centre may have been pressed into that neighbour.
template <class Neighbours>
FATHOM_HD bool is_seen(const Geometry& a, const Neighbours& neighbours, Vec3 point, Vec3 normal, Vec3 centre,
                       const SeamLengths& lengths) {
  const auto sees = [&](Vec3 beside) {
    return height_over(a, beside) <= 0.1f * lengths.gap &&
           !neighbours.any([&](const auto& n) { return n.holds(beside, lengths.gap); });
  };
  const Vec3 x = any_perpendicular(normal), y = cross(normal, x);
  for (int i = 0; i < 9; ++i) {
    const Vec3 aside = static_cast<float>(i % 3 - 1) * x + static_cast<float>(i / 3 - 1) * y;
    if (sees(mul_add(point, lengths.step, aside))) return true;
  }
  constexpr float upright = 0.01f;
  return neighbours.any([&](const auto& n) {
    return n.holds(point, lengths.gap) && n.any_face_before(centre, [&](const Hull::Plane& plane) {
      const Vec3 out = mul_add(plane.normal, -dot(plane.normal, normal), normal);
      const float slope = length_squared(out), depth = lengths.step - plane_height(plane, point);
      return slope > upright && sees(mul_add(point, depth / slope, out));
    });
  });
}

/// The point or, if it is outside, a nearby one of the shape.
FATHOM_HD Vec3 pulled_inside(const Geometry& g, Vec3 point) {
  if (g.type == ShapeType::box) return max(-g.half_extents, min(point, g.half_extents));
  if (is_round(g)) {
    const Vec3 on_core{0, 0, clamp(point.z, -g.half_extents.z, g.half_extents.z)}, out = point - on_core;
    const float distance = length(out);
    return distance > g.radius ? mul_add(on_core, g.radius / distance, out) : point;
  }
  Vec3 inside = point;
  for (int f = 0; f < g.hull.face_count; ++f)
    if (const float height = plane_height(g.hull.planes[f], inside); height > 0)
      inside = mul_add(inside, -height, g.hull.planes[f].normal);
  if (g.radius == 0) return inside;
  const float distance = length(point - inside);
  return distance > g.radius ? mul_add(inside, g.radius / distance, point - inside) : point;
}

/// Calls act(point) for the manifold's points on A until it returns true; returns whether it did. Skips points beside
/// which A itself rises by more than `gap` (m): they lie under B's face beside the touched feature. If that is so of
/// all, because B's face ends before it, the outermost count.
template <class Act>
FATHOM_HD bool any_outermost(const Geometry& a, const Manifold& m, float gap, const Act& act) {
  float outermost = -3e38f;
  for (int i = 0; i < m.count; ++i) outermost = max(outermost, dot(m.normal, pulled_inside(a, on_first(m, i))));
  const float farthest = min(dot(m.normal, support(a, m.normal)), outermost) - gap;
  for (int i = 0; i < m.count; ++i)
    if (const Vec3 point = pulled_inside(a, on_first(m, i)); dot(m.normal, point) >= farthest && act(point))
      return true;
  return false;
}

/// Whether the point is inside a neighbour.
template <class Neighbours>
FATHOM_HD bool is_held(const Neighbours& neighbours, Vec3 point) {
  return neighbours.any([&](const auto& n) { return n.holds(point, 0); });
}

/// Whether the manifold touches A where a B with this centre can touch the union of A and its neighbours.
template <class Neighbours>
FATHOM_HD bool counts_at_seam(const Geometry& a, const Neighbours& neighbours, const Manifold& m, Vec3 centre,
                              const SeamLengths& lengths) {
  const bool is_face = is_face_normal(a, m.normal);
  return any_outermost(a, m, lengths.gap, [&](Vec3 point) {
    return !rises_beside(neighbours, point, m.normal, lengths.gap) ||
           (is_face && is_seen(a, neighbours, point, m.normal, centre, lengths));
  });
}

/// Whether is(neighbours at that moment) is true at the beginning of the step or, where some of them move against A, at
/// its end. `Neighbours` here and below: `moments()` of `at(moment)`.
template <class Neighbours, class Is>
FATHOM_HD bool at_any_moment(const Neighbours& neighbours, const Is& is) {
  for (int moment = 0; moment < neighbours.moments(); ++moment)
    if (is(neighbours.at(moment))) return true;
  return false;
}

/// Adds up to two points where the core of a round shape runs over the face, not higher than `reach`.
FATHOM_HD void round_face_contact(const HullView& hull, int face, const RoundShape& round, float reach, Manifold& m) {
  const Stretch stretch = clip_segment(hull, face, round.core, 0);
  if (stretch.empty()) return;
  m.normal = hull.planes[face].normal;
  add_stretch(hull, face, stretch, round, length_squared(round.core.along) > 0 ? 2 : 1, reach, m);
}

/// Replacement for a manifold of A, which has faces, and B that does not count: the manifold over another face of A
/// that B's centre is in front of, or an empty one. Where B, twice `half` thick (m), is deeper than `half`, it must
/// already be in the face: what is pressed into a corner would otherwise leave through the wall beside it.
template <class Neighbours>
FATHOM_HD Manifold seen_instead(const Geometry& a, const Geometry& b, const Pose& b_in_a, float margin, float half,
                                const Neighbours& neighbours, const SeamLengths& lengths) {
  const BoxHull box_a(a.half_extents), box_b(b.half_extents);
  const HullView hull_a = a.type == ShapeType::box ? view(box_a) : a.hull;
  const HullView hull_b = b.type == ShapeType::box ? view(box_b) : b.hull;
  const bool is_round_b = is_round(b);
  const RoundShape round = is_round_b ? transform(b_in_a, round_shape(b)) : RoundShape{};
  const Quat to_b = conjugate(b_in_a.rotation);
  float last = 3e38f;
  int last_face = -1;
  // Starting with the least deeply touched face.
  for (;;) {
    int face = -1;
    float highest = no_separation;
    for (int f = 0; f < hull_a.face_count; ++f) {
      const Hull::Plane& plane = hull_a.planes[f];
      if (!(plane_height(plane, b_in_a.position) > 0)) continue;
      const Vec3 lowest = transform(b_in_a, support(b, rotate(to_b, -plane.normal)));
      const float separation = plane_height(plane, lowest);
      const bool is_next = separation < last || (separation == last && f > last_face);
      if (separation <= margin && is_next && separation > highest) face = f, highest = separation;
    }
    if (face < 0) return {};
    last = highest, last_face = face;
    if (highest < -lengths.deepest) return {};
    Manifold over;
    if (is_round_b) {
      round_face_contact(hull_a, face, round, round.radius + margin, over);
    } else {
      AxisCache cache;
      hull_face_contact(make_hull_pair(hull_a, hull_b, b_in_a), face, false, margin + hull_b.radius, {}, cache, over);
      round_off(over, 0, hull_b.radius);
    }
    if (highest <= -half && nearest_separation(over) >= 0) continue;
    for (int i = 0; i < over.count; ++i)
      if (at_any_moment(neighbours, [&](const auto& now) {
            return is_seen(a, now, pulled_inside(a, on_first(over, i)), over.normal, b_in_a.position, lengths);
          }))
        return over;
  }
}

/// The manifold `m` of an edge and B, turned to a face beside that edge: its points that lie less than `gap` (m) beside
/// the edge or, of a shape with faces, the lowest corner. Without it a ball over the gap between two tiles would sink
/// in, because each tile would leave it to the other.
FATHOM_HD Manifold turned_to_face(const Manifold& m, Vec3 face_normal, const Geometry& b, const Pose& b_in_a,
                                  float gap) {
  Manifold turned;
  turned.normal = face_normal;
  const auto add = [&](Vec3 on_edge, Vec3 to_core, float radius, float reach, std::uint32_t feature) {
    const float height = dot(face_normal, to_core), separation = height - radius;
    if (length_squared(to_core) - height * height <= reach * reach)
      turned.points[turned.count++] = {mul_add(on_edge, 0.5f * separation, face_normal), separation, feature};
  };
  if (!has_faces(b)) {
    for (int i = 0; i < m.count; ++i)
      add(on_first(m, i), (m.points[i].separation + b.radius) * m.normal, b.radius, gap, m.points[i].feature);
    return turned;
  }
  constexpr float near = 4;  // the edge touches a corner's side, not its tip
  const Vec3 tip = transform(b_in_a, support(b, inverse_rotate(b_in_a.rotation, -face_normal)));
  add(on_first(m, 0), tip - on_first(m, 0), 0, near * gap, m.points[0].feature);
  return turned;
}

/// The manifold turned to the face of A that it is nearest to, of those that can be seen beside its first point.
template <class Neighbours>
FATHOM_HD Manifold turned_to_seen_face(const Geometry& a, const Geometry& b, const Pose& b_in_a,
                                       const Neighbours& neighbours, const SeamLengths& lengths, const Manifold& m) {
  const BoxHull box_a(a.half_extents);
  const HullView hull_a = a.type == ShapeType::box ? view(box_a) : a.hull;
  const Vec3 point = pulled_inside(a, on_first(m, 0));
  float nearest = 0;
  int face = -1;
  for (int f = 0; f < hull_a.face_count; ++f) {
    const Hull::Plane& plane = hull_a.planes[f];
    const float cosine = dot(plane.normal, m.normal);
    if (cosine > nearest && plane_height(plane, point) > -lengths.gap && plane_height(plane, b_in_a.position) > 0 &&
        at_any_moment(neighbours,
                      [&](const auto& now) { return is_seen(a, now, point, plane.normal, b_in_a.position, lengths); }))
      face = f, nearest = cosine;
  }
  return face < 0 ? Manifold{} : turned_to_face(m, hull_a.planes[face].normal, b, b_in_a, lengths.gap);
}

/// The part of a manifold that counts.
struct SeamManifold {
  Manifold manifold;
  bool has_neighbours = false;  ///< something lies beside the touched shape
  bool is_whole = true;         ///< it is the original manifold
};

/// For the manifold `m` of A, which has faces and some neighbours, and B.
template <class Neighbours>
FATHOM_HD SeamManifold kept_at_seam(const Geometry& a, const Geometry& b, const Pose& b_in_a, float margin, float half,
                                    const Neighbours& neighbours, const SeamLengths& lengths, const Manifold& m) {
  // Each shape alone pushes out a body pressed in by half its thickness, and one that no face carries.
  const Vec3 centre = b_in_a.position;
  if (height_over(a, centre) < 0 || is_held(neighbours.at(0), centre)) return {m};
  if (at_any_moment(neighbours, [&](const auto& now) { return counts_at_seam(a, now, m, centre, lengths); }))
    return {m, true, true};
  Manifold instead = seen_instead(a, b, b_in_a, margin, half, neighbours, lengths);
  if (instead.count == 0) instead = turned_to_seen_face(a, b, b_in_a, neighbours, lengths, m);
  if (instead.count == 0 && nearest_separation(m) < -0.5f * half) return {m};
  return {instead, true, false};
}

/// The nearest points of A and of B beside it, as a manifold with this normal in A's frame.
FATHOM_HD Manifold nearest_point(const Geometry& a, const Geometry& b, const Pose& b_in_a, Vec3 normal) {
  // Alternating projections between two convex shapes converge to the nearest points.
  constexpr int max_rounds = 64;
  constexpr float still = 1e-6f;
  Vec3 of_b = b_in_a.position, of_a = pulled_inside(a, of_b);
  for (int i = 0; i < max_rounds; ++i) {
    of_b = transform(b_in_a, pulled_inside(b, inverse_transform(b_in_a, of_a)));
    const Vec3 nearer = pulled_inside(a, of_b), moved = nearer - of_a;
    of_a = nearer;
    if (length_squared(moved) < still * still) break;
  }
  Manifold m;
  m.normal = normal;
  m.count = 1;
  m.points[0] = {0.5f * (of_a + of_b), dot(normal, of_b - of_a), 0};
  return m;
}

}  // namespace fathom
