// Queries about compounds: those of geometry/query.hpp and separation.hpp, applied to all children that may be
// affected.
#pragma once

#include <vector>

#include "geometry/placed_shape.hpp"
#include "geometry/query.hpp"

namespace fathom {

/// Appends the children whose bounds overlap `box` (m, the compound's frame), in the compound's internal order.
void find_children(const Compound& compound, const Aabb& box, std::vector<std::uint32_t>& found);

// Of equally near children, the one with the lowest index counts as hit.
std::optional<SurfaceHit> ray_cast_at_compound(const Compound& compound, const Pose& pose, const Ray& ray,
                                               double limit);
std::optional<SurfaceHit> shape_cast_at_compound(const PlacedShape& moving, Vec3 translation, const Compound& compound,
                                                 const Pose& pose, double limit);
bool touches_compound(const PlacedShape& shape, const Compound& compound, const Pose& pose);

/// Tight bounds of the placed shape, like `bounds`; for a compound those of its children.
Aabb tight_bounds(const Geometry& shape, const Pose& pose);

}  // namespace fathom
