// Volume, centre of mass and inertia of everything within a radius of a convex polyhedron.
#pragma once

#include "geometry/polygon_mesh.hpp"
#include "geometry/solid.hpp"

namespace fathom {

/// Integrals over the polyhedron and all within `radius` (m, 0 or more) of it. Exact: besides the polyhedron it
/// consists of a prism on each face, a sector of a cylinder along each edge and a sector of a ball at each vertex, as
/// in Steiner's formula (R. Schneider, Convex Bodies: The Brunn–Minkowski Theory, 2nd ed. 2014, section 4.1).
SolidIntegrals rounded_solid(const PolygonMesh& mesh, double radius);

}  // namespace fathom
