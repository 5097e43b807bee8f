// Contacts: what the application is told about them, and what it may change before they are solved.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>
#include <fathom/math.hpp>

namespace fathom {

/// Two bodies, in ascending order of index, that began or ceased to touch in a step. They begin to touch in the first
/// step in which their contact carries an impulse, or at whose start they are less than 1 mm apart (halved for small
/// bodies until it is at most a hundredth of the smaller bounding radius). They cease to touch in a step in which the
/// contact carries no impulse and at whose start they are more than twice that distance apart. Falling asleep and
/// waking change nothing.
struct ContactEvent {
  BodyId a;                ///< the one with the lower index
  BodyId b;                ///< the other
  std::uint64_t step = 0;  ///< `World::step_count()` after that step
};
/// Two bodies that met faster than `SolverSettings::restitution_threshold`: a point of their contact approached faster
/// than that as the step began, and the contact stopped it or made it bounce, whether or not they already touched
/// elsewhere (as a post does that falls over). Each impact is reported once, by its fastest point.
struct HitEvent {
  BodyId a;                    ///< the one with the lower index
  BodyId b;                    ///< the other
  Vec3 point;                  ///< m, world, where they met
  Vec3 normal;                 ///< unit, from a to b
  float approach_speed;        ///< m/s, as the step began
  std::uint32_t reserved = 0;  ///< padding
  std::uint64_t step = 0;      ///< `World::step_count()` after that step
};

/// One contact point as solved in the last step.
struct ContactPointInfo {
  Vec3 position;     ///< m, world
  float separation;  ///< m, negative where the bodies overlap
  float impulse;     ///< N·s along the normal over the step; the mean force is this divided by dt (see ContactInfo)
};
/// A contact as solved in the last step. The impulses of its points sum to its impulse over the step, in the
/// proportions of the last substep.
struct ContactInfo {
  BodyId a;                    ///< the one with the lower index
  BodyId b;                    ///< the other
  Vec3 normal;                 ///< unit, from a to b
  int point_count = 0;         ///< number of valid `points`
  ContactPointInfo points[4];  ///< the contact points
  int colour = -1;             ///< in the constraint graph; −1 if the pair has none (asleep, or solved one by one)
  std::uint32_t child_a = 0;   ///< if a is a compound: which child, see `Compound::children`
  std::uint32_t child_b = 0;   ///< if b is a compound
};

/// A contact that is about to be solved (`World::set_pre_solve_callback`), as the step finds it: the world's poses and
/// velocities are those at the start of the step. What the callback changes holds for this step, and while the contact
/// sleeps.
///
/// The callback is asked in every step in which one of the two bodies is awake, from the first step that finds them
/// near enough to touch within it. A pair with several contacts, such as that of a compound, is asked about each. If a
/// fast body would otherwise end up behind another (`BodyDef::bullet`), the question may come after the step is solved
/// and without points: then only `enabled` counts.
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
  float friction = 0;     ///< Coulomb coefficient of both materials, ≥ 0
  float restitution = 0;  ///< 0 … 1, of both materials
  /// Velocity of b's surface relative to a's (m/s, world axes), besides the motion of the bodies: from both materials
  /// (`Material::surface_velocity`), at most 1e6.
  Vec3 surface_velocity;
};

}  // namespace fathom
