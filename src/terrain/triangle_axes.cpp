#include "terrain/triangle_axes.hpp"

#include "terrain/triangle_lanes.hpp"

namespace fathom {
namespace {

void store(Eight from, float (&to)[8]) { *reinterpret_cast<Eight*>(to) = from; }
void store(EightInts from, std::int32_t (&to)[8]) { *reinterpret_cast<EightInts*>(to) = from; }

struct FacesOfEight {
  Eight separations = eight(-3e38f);
  EightInts faces = eight(-1);
};

/// Per triangle, the shape's face with the largest separation.
FacesOfEight best_faces(const HullView& shape, const Triangles& t) {
  FacesOfEight best;
  for (int f = 0; f < shape.face_count; ++f) {
    const Eight separation = separation_from_face(shape, f, t);
    const EightInts better = separation > best.separations;
    best.separations = select(better, separation, best.separations);
    best.faces = select(better, eight(f), best.faces);
  }
  return best;
}

/// Edge pairs with the largest separation, if that is above a threshold.
struct EdgesOfEight {
  Eight separations;
  EightInts of_triangle = eight(-1), of_shape = eight(-1);
};

/// The normals of a triangle's edge are all directions across it that do not point into the triangle. The normals of a
/// hull's edge form an arc of the Gauss map between its two faces' normals. Most pairs have no normal in common, which
/// signs reveal before a square root is needed. Returns the triangles within the margin.
EightInts find_edges(const Triangles& t, const TurnedShape& shape, Eight noise, Eight margin, EightInts near,
                     EdgesOfEight& best) {
  const Eight zero = eight(0.0f), one = eight(1.0f), shortest = eight(min_cross);
  int number = 0;
  for (const EdgeArc& arc : shape.edges()) {
    const EightVec3 along = eight(arc.along), left = eight(arc.of_left), right = eight(arc.of_right);
    for (int k = 0; k < 3; ++k) {
      const EightVec3 across = cross(t.along[k], along);
      const EightVec3 axis = negated_where(dot(across, t.inward[k]) > zero, across);
      // It points into the shape and lies between the normals of its edge's faces.
      const EightInts between = (dot(axis, left) * dot(axis, right) <= zero) & (dot(axis, eight(arc.middle)) < zero);
      if (bits(between & near) == 0) continue;
      const Eight l = sqrt(length_squared(axis));
      const EightVec3 normal = (one / l) * axis;
      const Eight scaled_noise = noise * sqrt(t.squared_lengths[k] * eight(length_squared(arc.along))) / l;
      const Eight separation = dot(normal, eight(arc.from) - t.corners[k]) - scaled_noise;
      const EightInts better = between & (l > shortest) & (separation > best.separations);
      best.separations = select(better, separation, best.separations);
      best.of_triangle = select(better, eight(k), best.of_triangle);
      best.of_shape = select(better, eight(number), best.of_shape);
      near = near & ~(better & (separation > margin));
    }
    if (bits(near) == 0) break;
    ++number;
  }
  return near;
}

/// A bit for each of the triangles `near` whose plane and sides are within the margin of the round shape.
unsigned near_of_round(const EightTriangles& triangles, const EightPlanes& planes, const RoundShape& round,
                       float margin, EightInts near) {
  const EightVec3 from = eight(round.core.from), end = eight(end_of(round.core));
  const Eight reach = eight(round.radius + margin);
  near = near & (min(plane_height(planes, from), plane_height(planes, end)) <= reach);
  if (bits(near) == 0) return 0;
  const Triangles t(triangles);
  const Eight beyond_rounding = eight(1.0001f) * reach;
  for (int k = 0; k < 3; ++k) {
    const Eight inside = max(dot(t.inward[k], from - t.corners[k]), dot(t.inward[k], end - t.corners[k]));
    near = near &
           ((inside >= eight(0.0f)) | (inside * inside <= beyond_rounding * beyond_rounding * t.squared_lengths[k]));
  }
  return bits(near);
}

/// How far (m) behind each triangle the shape's centre may be.
Eight allowed_behind(const EightPlanes& planes, const TurnedShape& shape, std::span<const Vec3> pushed) {
  const Eight on_that_side = eight(0.5f);  // normals within 60 degrees
  Eight allowed = eight(0.5f * shape.inner());
  for (const Vec3 normal : pushed)
    allowed = select(dot(planes.normals, eight(normal)) > on_that_side, eight(shape.outer()), allowed);
  return allowed;
}

}  // namespace

TriangleAxes axes_of(const EightTriangles& triangles, const TurnedShape& shape, float margin,
                     std::span<const Vec3> pushed) {
  TriangleAxes axes;
  const EightPlanes planes{vectors(triangles.planes), eight(triangles.planes.w)};
  EightInts near =
      (lane_numbers() < eight(triangles.count)) & (planes.offsets <= allowed_behind(planes, shape, pushed));
  if (shape.is_round()) {
    axes.near = near_of_round(triangles, planes, shape.round(), margin, near);
    return axes;
  }
  const Eight of_normal = lowest_along(shape.turned(), planes.normals) - planes.offsets;
  near = near & (of_normal <= eight(margin));
  if (bits(near) == 0) return axes;

  const Triangles t(triangles);
  const FacesOfEight faces = best_faces(shape.turned(), t);
  near = near & (faces.separations <= eight(margin));
  // As `make_tolerance`.
  const Eight reach = t.reach + eight(shape.outer());
  const Eight tolerance =
      min(eight(max_axis_tolerance), eight(axis_tolerance_share) * min(t.reach, eight(shape.inner()))) +
      eight(axis_rounding) * reach;
  EdgesOfEight edges{max(of_normal, faces.separations) + tolerance};
  if (bits(near) != 0) near = find_edges(t, shape, eight(separation_rounding) * reach, eight(margin), near, edges);
  axes.near = bits(near);
  store(of_normal, axes.of_normal), store(faces.separations, axes.of_face), store(faces.faces, axes.face);
  store(edges.of_triangle, axes.edge), store(edges.of_shape, axes.edge_of_shape);
  return axes;
}

}  // namespace fathom
