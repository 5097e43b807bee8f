// Contact manifolds between two convex shapes: pure functions for host and device.
//
// Everything is told in the frame of shape A: the pose of B relative to A comes in, the normal and points go
// out. That keeps precision far from the world's origin and saves one rotation a pair.
#pragma once

#include "geometry/geometry.hpp"

namespace fathom {

inline constexpr int max_manifold_points = 4;

struct ManifoldPoint {
  Vec3 position;         ///< in A's frame, half-way between the two surfaces
  float separation = 0;  ///< m along the normal, negative where the shapes overlap
  /// Which features of A and B meet here; equal from step to step for the same pair of features.
  std::uint32_t feature = 0;
};

struct Manifold {
  Vec3 normal;  ///< unit, in A's frame, from A to B
  int count = 0;
  union {  // left unset by the constructor: most pairs of a broad phase do not touch
    ManifoldPoint points[max_manifold_points];
  };

  FATHOM_HD Manifold() {}
};

/// Of its points (m); of none a number beyond all lengths.
FATHOM_HD float nearest_separation(const Manifold& m) {
  float nearest = 3e38f;
  for (int i = 0; i < max_manifold_points; ++i)
    if (i < m.count) nearest = min(nearest, m.points[i].separation);
  return nearest;
}

/// Whether the points over a face show less than half of an overlap that a face's axis has, by the `separation` along
/// it: what touches deepest is beside that face, whose axis is the best within `tolerance` (m) only.
FATHOM_HD bool hides_overlap(const Manifold& m, float separation, float tolerance) {
  if (m.count == 0) return separation <= 0;
  float deepest = m.points[0].separation;
  for (int i = 1; i < max_manifold_points; ++i)
    if (i < m.count) deepest = min(deepest, m.points[i].separation);
  return separation < -4 * tolerance && deepest > 0.5f * separation;
}

/// What the last call learned of the pair: the axis to try first. Zero means nothing is known. Two boxes name axes
/// 0 … 2 instead of faces and edges; of a polyhedron and a round shape `a` is a face of the polyhedron, whichever it
/// is.
struct AxisCache {
  enum Kind : std::uint8_t { none, face_a, face_b, edges };
  std::uint8_t kind = none;
  std::uint8_t a = 0;              ///< face of A, or edge of A (undirected index)
  std::uint8_t b = 0;              ///< face of B, or edge of B
  std::uint8_t separated : 1 = 0;  ///< the axis separated the shapes by more than the margin
  std::uint8_t reduced : 1 = 0;    ///< the manifold has not all corners of the patch
  std::uint8_t wait : 6 = 0;       ///< steps for which its corners stay, until the load has settled on them
};

/// Where the last step's load of a pair lay, whose manifold has not all corners of its patch.
struct PatchLoad {
  Vec3 at;  ///< m, in A's frame
  bool is_known = false;
};

/// Contact points of the shapes `a` and `b`, with `b_in_a` the pose of B in A's frame, where they are nearer
/// than `margin` ≥ 0 (m). Returns a manifold with count 0 where they are not. `cache` is read and written.
/// Any order of shape types is accepted. Where a patch has more than four corners, `load` tells which of them matter.
Manifold collide(const Geometry& a, const Geometry& b, const Pose& b_in_a, float margin, AxisCache& cache,
                 const PatchLoad& load = {});

}  // namespace fathom
