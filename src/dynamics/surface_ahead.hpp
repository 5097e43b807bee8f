// What part of a surface a fast body will touch within a step, and how far its way there is free
// (dynamics/look_ahead.hpp, triangle by triangle).
#pragma once

#include "dynamics/triangle_ahead.hpp"
#include "terrain/surface_contact.hpp"

namespace fathom {

/// Of the surface `a` and the body `b` with the speculative margin `margin` (m): the first impact with any of its
/// triangles that gets deep within the step. `half`: half of b's thickness (m). `rest`: a second margin (m).
SurfaceAhead look_ahead(const Mover& a, const Mover& b, const Pose& b_in_a, float margin, float rest, float half,
                        float dt, SurfaceScratch& scratch);

/// The way of the centre of b to `end_b` while the surface goes to `end_a` (triangle_ahead.hpp).
CentreWay centre_way(const Mover& a, const Mover& b, const Pose& end_a, const Pose& end_b, float depth,
                     SurfaceScratch& scratch);

}  // namespace fathom
