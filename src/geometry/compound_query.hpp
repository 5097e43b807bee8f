// Queries about compounds: what those of geometry/query.hpp and separation.hpp answer of one convex shape, asked of all
// children that may be concerned.
#pragma once

#include <vector>

#include "geometry/placed_shape.hpp"
#include "geometry/query.hpp"

namespace fathom {

/// Appends the children whose bounds meet `box` (m, the compound's frame), in an order of the compound's own.
void find_children(const Compound& compound, const Aabb& box, std::vector<std::uint32_t>& found);

// Of equally near children the one with the least index is hit.
std::optional<SurfaceHit> ray_cast_at_compound(const Compound& compound, const Pose& pose, Vec3 origin,
                                               Vec3 translation, double limit);
std::optional<SurfaceHit> shape_cast_at_compound(const PlacedShape& moving, Vec3 translation, const Compound& compound,
                                                 const Pose& pose, double limit);
bool touches_compound(const PlacedShape& shape, const Compound& compound, const Pose& pose);

/// Tight bounds of the placed shape, as `bounds`; of a compound those of its children.
Aabb tight_bounds(const Geometry& shape, const Pose& pose);

}  // namespace fathom
