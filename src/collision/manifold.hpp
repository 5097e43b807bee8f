// Contact manifolds between two convex shapes: pure functions for host and device.
//
// Everything is in the frame of shape A: the pose of B relative to A comes in, the normal and points go out. This keeps
// precision far from the world's origin and saves one rotation per pair.
#pragma once

#include "geometry/geometry.hpp"

namespace fathom {

inline constexpr int max_manifold_points = 4;

struct ManifoldPoint {
  Vec3 position;         ///< in A's frame, half-way between the two surfaces
  float separation = 0;  ///< m along the normal, negative where the shapes overlap
  /// The features of A and B that meet here; the same from step to step for the same features.
  std::uint32_t feature = 0;
};

struct Manifold {
  Vec3 normal;  ///< unit, in A's frame, from A to B
  int count = 0;
  union {  // not initialised by the constructor: most pairs of a broad phase do not touch
    ManifoldPoint points[max_manifold_points];
  };

  FATHOM_HD Manifold() {}
};

/// Least separation of its points (m); a huge number if there are none.
FATHOM_HD float nearest_separation(const Manifold& m) {
  float nearest = 3e38f;
  for (int i = 0; i < max_manifold_points; ++i)
    if (i < m.count) nearest = min(nearest, m.points[i].separation);
  return nearest;
}

/// Whether the points over a face show less than half of the overlap along the face's axis, `separation`: the deepest
/// feature then is beside that face, whose axis is the best only within `tolerance` (m).
FATHOM_HD bool hides_overlap(const Manifold& m, float separation, float tolerance) {
  if (m.count == 0) return separation <= 0;
  float deepest = m.points[0].separation;
  for (int i = 1; i < max_manifold_points; ++i)
    if (i < m.count) deepest = min(deepest, m.points[i].separation);
  return separation < -4 * tolerance && deepest > 0.5f * separation;
}

/// The axis to try first, from the last call for the pair. Zero means nothing is known. For two boxes `a` and `b` are
/// axes 0 … 2 instead of faces and edges; for a polyhedron and a round shape `a` is a face of the polyhedron, whether
/// that is A or B.
struct AxisCache {
  enum Kind : std::uint8_t { none, face_a, face_b, edges };
  std::uint8_t kind = none;
  std::uint8_t a = 0;              ///< face of A, or edge of A (undirected index)
  std::uint8_t b = 0;              ///< face of B, or edge of B
  std::uint8_t separated : 1 = 0;  ///< the axis separated the shapes by more than the margin
  std::uint8_t reduced : 1 = 0;    ///< the manifold lacks some corners of the patch
  std::uint8_t wait : 6 = 0;       ///< steps for which its corners stay fixed, until the load has settled on them
};

/// Position of the last step's load, for a pair whose manifold lacks some corners of its patch.
struct PatchLoad {
  Vec3 at;  ///< m, in A's frame
  bool is_known = false;
};

/// Contact points of the shapes `a` and `b`, with `b_in_a` the pose of B in A's frame, if they are nearer than `margin`
/// ≥ 0 (m); otherwise a manifold with count 0. `cache` is read and written. Any order of shape types is accepted. Where
/// a patch has more than four corners, `load` decides which of them to keep.
Manifold collide(const Geometry& a, const Geometry& b, const Pose& b_in_a, float margin, AxisCache& cache,
                 const PatchLoad& load = {});

}  // namespace fathom
