// Queries about surfaces: those of geometry/query.hpp and separation.hpp, applied to all triangles that may be
// affected. A surface consists of its triangles only; nothing behind them is solid. A shape entirely behind touches
// nothing, and a shape coming from behind passes through.
#pragma once

#include "geometry/query.hpp"
#include "geometry/separation.hpp"

namespace fathom {

std::optional<SurfaceHit> ray_cast_at_surface(const Geometry& surface, const Pose& pose, const Ray& ray, double limit);

std::optional<SurfaceHit> shape_cast_at_surface(const PlacedShape& moving, Vec3 translation, const Geometry& surface,
                                                const Pose& pose, double limit);

bool touches_surface(const PlacedShape& shape, const Geometry& surface, const Pose& pose);

/// `normal` points from the surface to the shape; points are relative to the surface's position.
Separation separation_from_surface(const Geometry& surface, const Pose& pose, const PlacedShape& shape);

}  // namespace fathom
