// Which triangles a shape may meet on its way.
#pragma once

#include "terrain/surface_triangle.hpp"
#include "terrain/turned_shape.hpp"

namespace fathom {

/// A bit for each triangle that the shape may come nearer to than `around` (m) while its centre goes from the origin by
/// `way` (m); of the others, an axis that stands still shows that it does not.
unsigned met_on_way(const EightTriangles& triangles, const TurnedShape& shape, Vec3 way, float around);

}  // namespace fathom
