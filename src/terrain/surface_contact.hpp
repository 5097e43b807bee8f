// Contacts of a surface with a convex shape: one manifold per contact direction and material.
//
// A box may lie on hundreds of triangles. Their points are grouped by normal, and each group keeps the points of its
// largest patch: a box on a flat floor has one manifold of four points however fine the floor is.
#pragma once

#include <span>
#include <vector>

#include "terrain/found_triangles.hpp"
#include "terrain/surface_patch.hpp"
#include "terrain/triangles_ahead.hpp"
#include "terrain/turned_shape.hpp"

namespace fathom {

/// Intermediate results; kept from call to call for their memory.
struct SurfaceScratch {
  struct Touch {
    Manifold manifold;
    float nearest;  ///< separation (m)
    bool is_deep;   ///< see `TriangleContact`
    std::uint8_t material;
    int group;
  };
  Aabb searched;                         ///< m, the surface's frame
  std::vector<std::uint32_t> triangles;  ///< found by the search
  std::vector<EightTriangles> eights;    ///< the same triangles, relative to the shape's centre
  FoundIndex index;                      ///< of eights
  std::vector<Vec3> pushed;              ///< normals of pushes
  TurnedShape shape;                     ///< the convex shape
  ShapeOnWay on_way;                     ///< the same and its motion within the step
  std::vector<Touch> touches, doubtful;  ///< doubtful: see `TriangleContact::is_doubtful`
};

/// Overwrites `eights` with the triangles whose bounds meet `box` (m, the surface's frame), relative to `origin`;
/// returns whether there are any.
bool find_triangles(const Surface& surface, const Aabb& box, Vec3 origin, SurfaceScratch& scratch);

/// Manifolds in the surface's frame, deepest first, where the shape `b` is nearer than `margin` (m). Normals point from
/// the surface to the shape. `pushes`: the last step's manifolds. `centre`: from the shape's centre to its body's
/// centre of mass (m, the surface's axes); the load is assumed there until a push locates it.
FATHOM_COMPONENT_API void collide_surface(const Surface& surface, const Geometry& b, const Pose& b_in_a, float margin,
                                          std::span<const SurfacePush> pushes, SurfaceScratch& scratch,
                                          SurfaceContact& contact, Vec3 centre = {});

}  // namespace fathom
