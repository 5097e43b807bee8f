// What the solver knows of a body while it works: one cache line, gathered and scattered by vector lanes.
#pragma once

#include <fathom/math.hpp>

namespace fathom {

/// Four quads, so that 4×4 transposes turn the bodies of neighbouring lanes into vectors. The fourth
/// elements of the last two hold the inverse mass and, for isotropic bodies, the inverse inertia; those of
/// the first two stay zero, so that (position, rotation) += h·(linear, angular) is one vector operation.
struct alignas(64) SolverBody {
  Vec3 linear;
  float zero0 = 0;
  Vec3 angular;
  float zero1 = 0;
  Vec3 moved;  ///< since the step began (m)
  float inverse_mass = 0;
  Vec3 turned;  ///< rotation vector since the step began (rad)
  float inverse_inertia = 0;
};

/// What integration needs of a body and contacts do not.
struct alignas(32) BodyMotion {
  Vec3 acceleration;         ///< from gravity and forces (m/s²)
  float linear_damping = 0;  ///< factor per substep
  Vec3 angular_acceleration;
  float angular_damping = 0;
};

/// The velocity that all contacts together gave the body in the last substep, and the velocity it is measured
/// from. See native/solver.hpp for why this replaces three of four warm-starting sweeps.
struct alignas(64) WarmStart {
  Vec3 linear;
  float pad0 = 0;
  Vec3 angular;
  float pad1 = 0;
  Vec3 linear_reference;
  float pad2 = 0;
  Vec3 angular_reference;
  float pad3 = 0;
};

/// What only bodies with several principal moments need: inverse inertia in world axes when the step began, and how the
/// body has turned since. Three quads. The pose stays as it was until the step ends, so that it can be done again.
struct alignas(16) WorldInertia {
  float xx = 0, yy = 0, zz = 0, xy = 0;
  float xz = 0, yz = 0, pad0 = 0, pad1 = 0;
  Quat rotation;
};

}  // namespace fathom
