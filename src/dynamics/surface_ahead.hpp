// What part of a surface a fast body will touch within a step, and how far its way there is free
// (dynamics/look_ahead.hpp, triangle by triangle).
#pragma once

#include "dynamics/look_ahead.hpp"
#include "terrain/surface_contact.hpp"

namespace fathom {

struct SurfaceAhead {
  Pose b_in_a;            ///< where manifolds are to be made
  float time = -1;        ///< s from the step's beginning to there; below zero: as the bodies are
  bool is_clear = false;  ///< no triangle is within `rest` of b's bounds, as the bodies are or on the way
};

/// Of the surface `a` and the body `b` with the speculative margin `margin` (m): the first impact with any of its
/// triangles that gets deep within the step. `half`: half of b's thickness (m). `rest`: a second margin (m).
SurfaceAhead look_ahead(const Mover& a, const Mover& b, const Pose& b_in_a, float margin, float rest, float half,
                        float dt, SurfaceScratch& scratch);

/// Where b's centre gets to on its way to `end_b`, while the surface goes to `end_a`, if it may come no nearer to the
/// back of a triangle than `depth` (m), or than it was: from there on it moves along the triangle.
struct CentreWay {
  static constexpr int max_stops = 4;
  int stops = 0;
  Vec3 normals[max_stops];  ///< of the triangles that stopped it, world axes
  Vec3 end;                 ///< m, world; unset if nothing stopped it
};
CentreWay centre_way(const Mover& a, const Mover& b, const Pose& end_a, const Pose& end_b, float depth,
                     SurfaceScratch& scratch);

}  // namespace fathom
