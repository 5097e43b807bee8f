// Contacts of a surface with a convex shape: one manifold for each direction in which it is touched.
//
// A box may lie on hundreds of triangles. Their points are gathered by normal, and of each group those that span the
// largest patch remain: a box on a flat floor has one manifold of four points however fine the floor is.
#pragma once

#include <vector>

#include "terrain/triangle_contact.hpp"

namespace fathom {

inline constexpr int max_surface_manifolds = 8;

struct SurfaceContact {
  Manifold manifolds[max_surface_manifolds];
  int count = 0;
};

/// What is found on the way; kept from call to call for its room.
struct SurfaceScratch {
  struct Touch {
    Manifold manifold;
    float nearest;  ///< separation (m)
    int group;
  };
  struct Corner {
    std::uint32_t name, triangle;
  };
  std::vector<std::uint32_t> triangles;  ///< found
  std::vector<TriangleHull> hulls;       ///< of them, relative to the other shape's centre
  std::vector<Corner> corners;           ///< of them, by name
  std::vector<Touch> touches;
};

/// Manifolds in the surface's frame, normals from the surface to the shape `b`, where they are nearer than `margin`
/// (m), those with the deepest points first.
FATHOM_COMPONENT_API void collide_surface(const Surface& surface, const Geometry& b, const Pose& b_in_a, float margin,
                                          SurfaceScratch& scratch, SurfaceContact& contact);

}  // namespace fathom
