// Face against face for hulls: the incident polygon clipped by the side planes of the reference face.
//
// I. E. Sutherland, G. W. Hodgman, "Reentrant Polygon Clipping", Comm. ACM 17 (1974), in the frame of the reference
// face: the sides are lines in its plane, and heights over it are interpolated. Each corner stores the edge that leaves
// it; the two edges that meet there finally identify it.
#pragma once

#include "collision/feature.hpp"
#include "collision/frame.hpp"
#include "collision/reduce.hpp"
#include "collision/support.hpp"

namespace fathom {

/// Orthonormal axes of a face: x and y in its plane, n its outward normal; heights are relative to `offset`.
struct FaceFrame {
  Vec3 x, y, n;
  float offset;
};
FATHOM_HD FaceFrame make_face_frame(const Hull::Plane& plane) {
  const Vec3 x = any_perpendicular(plane.normal);
  return {x, cross(plane.normal, x), plane.normal, plane.offset};
}
FATHOM_HD FacePoint to_face(const FaceFrame& f, Vec3 p, std::uint32_t label) {
  return {dot(f.x, p), dot(f.y, p), dot(f.n, p) - f.offset, label};
}
FATHOM_HD Vec3 from_face(const FaceFrame& f, float x, float y, float z) {
  return mul_add(mul_add(x * f.x, y, f.y), f.offset + z, f.n);
}

/// While clipping, a corner's `feature` is the half-edge that leaves it: an incident one, or with this bit set a
/// reference one.
inline constexpr std::uint32_t reference_edge = 0x8000;

/// Makes room in a full polygon by dropping every other corner, but not the lowest. Faces of more than 32 corners lose
/// little.
FATHOM_HD int thin(FacePoint* points, int count) {
  int lowest = 0;
  for (int i = 1; i < count; ++i) {
    if (points[i].z < points[lowest].z) lowest = i;
  }
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    if (i % 2 == lowest % 2) points[kept++] = points[i];
  }
  return kept;
}

/// The half plane x·nx + y·ny ≤ offset.
struct Side {
  float nx, ny, offset;
  std::uint32_t edge;
};
FATHOM_HD float distance_to(const Side& side, const FacePoint& p) {
  return fma(side.nx, p.x, fma(side.ny, p.y, -side.offset));
}

/// The side of reference half-edge `e`, moved outwards by `tolerance` (m).
FATHOM_HD Side make_side(const HullView& hull, const FaceFrame& frame, int e, float tolerance) {
  const Vec3 from = hull.vertices[hull.edges[e].origin];
  const Vec3 along = hull.vertices[hull.edges[e ^ 1].origin] - from;
  const float ex = dot(frame.x, along), ey = dot(frame.y, along);
  const float inv = 1.0f / fathom::sqrt(fma(ex, ex, ey * ey));
  const float nx = ey * inv, ny = -ex * inv;  // counter-clockwise: the outside is on the right
  return {nx, ny, fma(nx, dot(frame.x, from), fma(ny, dot(frame.y, from), tolerance)),
          reference_edge | static_cast<std::uint32_t>(e)};
}

/// Clips `count` points by one side; `out` has room for one more than `in`. Returns the number of points in `out`.
FATHOM_HD int clip_by_side(const Side& side, const FacePoint* in, int count, FacePoint* out) {
  int n = 0;
  float d0 = distance_to(side, in[0]);
  for (int i = 0; i < count; ++i) {
    const FacePoint& p0 = in[i];
    const FacePoint& p1 = in[i + 1 < count ? i + 1 : 0];
    const float d1 = distance_to(side, p1);
    if (d0 <= 0) out[n++] = p0;
    if ((d0 <= 0) != (d1 <= 0)) {
      const float s = d0 / (d0 - d1);
      const std::uint32_t leaving = d0 <= 0 ? side.edge : p0.feature;
      out[n++] = {fma(s, p1.x - p0.x, p0.x), fma(s, p1.y - p0.y, p0.y), fma(s, p1.z - p0.z, p0.z), leaving};
    }
    d0 = d1;
  }
  return n;
}

/// Feature id of a corner, from the edges that enter and leave it.
FATHOM_HD std::uint32_t corner_feature(const HullView& ref, const HullView& inc, std::uint32_t entering,
                                       std::uint32_t leaving, bool flipped) {
  const bool ref_enters = (entering & reference_edge) != 0, ref_leaves = (leaving & reference_edge) != 0;
  const std::uint32_t in = entering & ~reference_edge, out = leaving & ~reference_edge;
  if (!ref_enters && !ref_leaves) return vertex_feature(inc.edges[out].origin, !flipped);
  if (ref_enters && ref_leaves) {
    const bool forward = ref.edges[in].next == out;
    return vertex_feature(ref.edges[forward ? out : in].origin, flipped);
  }
  return ref_enters ? edge_feature(in >> 1, out >> 1, flipped) : edge_feature(out >> 1, in >> 1, flipped);
}

/// Writes the corners of the overlap of reference and incident face that are not higher than `margin`, with their
/// features, to `points` (room for `max_face_points`). Returns how many.
FATHOM_HD int clip_hull_faces(const HullView& ref, int ref_face, const HullView& inc, const Frame& inc_in_ref,
                              int inc_face, const FaceFrame& frame, float side_tolerance, float margin, bool flipped,
                              FacePoint* points) {
  FacePoint spare[max_face_points];
  FacePoint* now = points;
  FacePoint* then = spare;
  int count = 0;
  int e = inc.face_edges[inc_face];
  do {
    if (count == max_face_points) count = thin(now, count);
    const Vec3 vertex = transform(inc_in_ref, inc.vertices[inc.edges[e].origin]);
    now[count++] = to_face(frame, vertex, static_cast<std::uint32_t>(e));
    e = inc.edges[e].next;
  } while (e != inc.face_edges[inc_face]);

  e = ref.face_edges[ref_face];
  do {
    if (count == max_face_points) count = thin(now, count);
    const int left = clip_by_side(make_side(ref, frame, e, side_tolerance), now, count, then);
    FacePoint* const other = now;
    now = then, then = other, count = left;
    e = ref.edges[e].next;
  } while (count > 0 && e != ref.face_edges[ref_face]);

  int kept = 0;
  std::uint32_t entering = count > 0 ? now[count - 1].feature : 0;
  for (int i = 0; i < count; ++i) {
    FacePoint p = now[i];
    const std::uint32_t leaving = p.feature;
    p.feature = corner_feature(ref, inc, entering, leaving, flipped);
    entering = leaving;
    if (p.z <= margin) points[kept++] = p;
  }
  return kept;
}

}  // namespace fathom
