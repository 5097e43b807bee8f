// The solver's working copy of a body: one cache line, gathered and scattered by vector lanes.
#pragma once

#include <fathom/math.hpp>

namespace fathom {

/// Four quads: 4×4 transposes turn the bodies of neighbouring lanes into vectors. The fourth elements of the last two
/// hold the inverse mass and, for isotropic bodies, the inverse inertia; those of the first two stay zero, so
/// (position, rotation) += h·(linear, angular) is one vector operation.
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

/// Data of a body that integration needs and contacts do not.
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

/// Data needed only by bodies with several principal moments: inverse inertia in world axes at the start of the step,
/// and the rotation since. Three quads. The pose stays unchanged until the step ends: the step can be repeated.
struct alignas(16) WorldInertia {
  float xx = 0, yy = 0, zz = 0, xy = 0;
  float xz = 0, yz = 0, pad0 = 0, pad1 = 0;
  Quat rotation;
};

}  // namespace fathom
