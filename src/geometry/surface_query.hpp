// Queries about surfaces: what those of geometry/query.hpp and separation.hpp answer of one convex shape, asked of all
// triangles that may be concerned. A surface is its triangles, and nothing is behind them: what is wholly behind
// touches nothing, and what comes from there passes.
#pragma once

#include "geometry/query.hpp"
#include "geometry/separation.hpp"

namespace fathom {

std::optional<SurfaceHit> ray_cast_at_surface(const Geometry& surface, const Pose& pose, Vec3 origin, Vec3 translation,
                                              double limit);

std::optional<SurfaceHit> shape_cast_at_surface(const PlacedShape& moving, Vec3 translation, const Geometry& surface,
                                                const Pose& pose, double limit);

bool touches_surface(const PlacedShape& shape, const Geometry& surface, const Pose& pose);

/// Of the surface from the shape: `normal` points from the surface, points are seen from the surface's position.
Separation separation_from_surface(const Geometry& surface, const Pose& pose, const PlacedShape& shape);

}  // namespace fathom
