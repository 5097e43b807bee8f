// Contacts of a surface with a convex shape: one manifold for each direction in which it is touched.
//
// A box may lie on hundreds of triangles. Their points are gathered by normal, and of each group those that span the
// largest patch remain: a box on a flat floor has one manifold of four points however fine the floor is.
#pragma once

#include <span>
#include <vector>

#include "terrain/triangle_contact.hpp"

namespace fathom {

inline constexpr int max_surface_manifolds = 8;
/// Cosine of the angle between normals of manifolds that are the same from one step to the next.
inline constexpr float alike_normals = 0.9f;

struct SurfaceContact {
  Manifold manifolds[max_surface_manifolds];
  bool is_reduced[max_surface_manifolds];  ///< it has not all points
  int count = 0;
};

/// How the surface pushed the shape in the last step.
struct SurfacePush {
  Vec3 normal;     ///< unit, the surface's axes
  PatchLoad load;  ///< the surface's frame
};

/// What is found on the way; kept from call to call for its room.
struct SurfaceScratch {
  struct Touch {
    Manifold manifold;
    float nearest;  ///< separation (m)
    bool is_deep;   ///< see `TriangleContact`
    int group;
  };
  std::vector<std::uint32_t> triangles;  ///< found
  std::vector<EightTriangles> eights;    ///< of them, relative to the other shape's centre
  std::vector<Vec3> pushed;              ///< normals of pushes
  TurnedShape shape;                     ///< the other one
  std::vector<Touch> touches, doubtful;  ///< as `TriangleContact::is_doubtful` tells
};

/// Overwrites `eights` with the triangles whose bounds meet `box` (m, the surface's frame), as seen from `origin`;
/// returns whether there are any.
bool find_triangles(const Surface& surface, const Aabb& box, Vec3 origin, SurfaceScratch& scratch);

/// Manifolds in the surface's frame, normals from the surface to the shape `b`, where they are nearer than `margin`
/// (m), those with the deepest points first. `pushes`: of the manifolds that they had in the last step. `centre`: from
/// the shape's centre to the centre of mass of its body (m, the surface's axes), which is where its load is taken to be
/// as long as no push tells.
FATHOM_COMPONENT_API void collide_surface(const Surface& surface, const Geometry& b, const Pose& b_in_a, float margin,
                                          std::span<const SurfacePush> pushes, SurfaceScratch& scratch,
                                          SurfaceContact& contact, Vec3 centre = {});

}  // namespace fathom
