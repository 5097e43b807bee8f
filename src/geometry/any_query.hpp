// Queries about shapes of any kind, dispatched to query.hpp, separation.hpp, compound_query.hpp and surface_query.hpp.
#pragma once

#include "geometry/placed_shape.hpp"
#include "geometry/query.hpp"

namespace fathom {

/// Where `moving` first touches the shape, see `shape_cast`.
std::optional<SurfaceHit> shape_cast_at(const PlacedShape& moving, Vec3 translation, const Geometry& shape,
                                        const Pose& pose, double limit);
/// Whether the placed shape touches or overlaps the other.
bool touches(const PlacedShape& placed, const Geometry& shape, const Pose& pose);

/// Whether two shapes of any kind touch or overlap. Two surfaces never do.
bool touch(const Geometry& a, const Pose& pose_a, const Geometry& b, const Pose& pose_b);
/// Whether they do so while A moves along `translation` (m), which is not zero.
bool touch_on_way(const Geometry& a, const Pose& pose_a, Vec3 translation, const Geometry& b, const Pose& pose_b);

}  // namespace fathom
