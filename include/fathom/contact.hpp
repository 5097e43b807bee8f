// Contacts: what the application can read, and what it may change before they are solved.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>
#include <fathom/math.hpp>

namespace fathom {

/// Two bodies, in ascending order of index, that began or stopped touching in a step. They begin to touch in the first
/// step that starts with them less than 1 mm apart (halved for small bodies until it is at most a hundredth of the
/// smaller bounding radius) or in which their contact carries an impulse. They stop touching in a step that starts with
/// them more than twice that distance apart and in which the contact carries no impulse. Falling asleep and waking
/// change nothing.
struct ContactEvent {
  BodyId a;                ///< the one with the lower index
  BodyId b;                ///< the other
  std::uint64_t step = 0;  ///< `World::step_count()` after that step
};
/// An impact faster than `SolverSettings::restitution_threshold`: a point of the contact approached faster than that at
/// the start of the step, and the contact stopped it or made it bounce. The bodies may already touch elsewhere, like a
/// post that falls over. Each impact is reported once, by its fastest point.
struct HitEvent {
  BodyId a;                    ///< the one with the lower index
  BodyId b;                    ///< the other
  Vec3 point;                  ///< m, world, where they hit
  Vec3 normal;                 ///< unit, from a to b
  float approach_speed;        ///< m/s, at the start of the step
  std::uint32_t reserved = 0;  ///< padding
  std::uint64_t step = 0;      ///< `World::step_count()` after that step
};

/// One contact point as solved in the last step.
struct ContactPointInfo {
  Vec3 position;     ///< m, world
  float separation;  ///< m, negative where the bodies overlap
  float impulse;     ///< N·s along the normal over the step; the mean force is this divided by dt (see ContactInfo)
};
/// A contact as solved in the last step. Its points' impulses sum to its impulse over the step, in the proportions of
/// the last substep.
struct ContactInfo {
  BodyId a;                    ///< the one with the lower index
  BodyId b;                    ///< the other
  Vec3 normal;                 ///< unit, from a to b
  int point_count = 0;         ///< number of valid `points`
  ContactPointInfo points[4];  ///< the contact points
  int colour = -1;             ///< in the constraint graph; −1 if the pair has none (asleep, or none was free)
  /// If a is a compound: which child, see `Compound::children`. If it is a mesh or a height field with materials: which
  /// of them, see `Surface::materials`.
  std::uint32_t child_a = 0;
  std::uint32_t child_b = 0;  ///< the same of b
};

/// A contact about to be solved (`World::set_pre_solve_callback`). The world's poses and velocities are those at the
/// start of the step. The callback's changes hold for this step, and while the contact sleeps.
///
/// The callback is called in every step in which either body is awake, from the first step in which they come near
/// enough to touch; for a pair with several contacts, such as a compound's, once for each. If a fast body would
/// otherwise tunnel through another (`BodyDef::bullet`), the call may come after the step is solved and without points:
/// then only `enabled` counts.
struct PreSolveContact {
  BodyId a;                    ///< the one with the lower index
  BodyId b;                    ///< the other
  std::uint32_t child_a = 0;   ///< see ContactInfo
  std::uint32_t child_b = 0;   ///< see ContactInfo
  Vec3 normal;                 ///< unit, from a to b
  int point_count = 0;         ///< number of valid `points`
  ContactPointInfo points[4];  ///< with the last step's impulses; 0 for new points

  /// False: the bodies do not collide in this step, and events do not count them as touching.
  bool enabled = true;
  /// Combined Coulomb coefficient, ≥ 0. Where friction depends on direction (`Material::friction_axis`) it is the
  /// largest possible one; if the callback changes it, the new one acts in all directions.
  float friction = 0;
  float restitution = 0;  ///< 0 … 1, combined
  /// Velocity of b's surface relative to a's, without the motion of the bodies (m/s, world axes, at most 1e6); from
  /// both materials (`Material::surface_velocity`).
  Vec3 surface_velocity;
};

}  // namespace fathom
