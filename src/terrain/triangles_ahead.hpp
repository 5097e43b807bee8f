// Which triangles a shape may meet on its path.
#pragma once

#include "terrain/eight_triangles.hpp"
#include "terrain/surface_triangle.hpp"
#include "terrain/turned_shape.hpp"

namespace fathom {

/// A bit for each triangle to which the shape may come nearer than `around` (m) while its centre moves from the origin
/// by `way` (m); the others have a fixed separating axis.
unsigned met_on_way(const EightTriangles& triangles, const TurnedShape& shape, Vec3 way, float around);

}  // namespace fathom
