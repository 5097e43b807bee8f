// Contacts: what the application is told of them, and what it may change of them before they are solved.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>
#include <fathom/math.hpp>

namespace fathom {

/// Two bodies, in ascending order of index, that began or ceased to touch in a step. They touch from the step in which
/// their contact carries an impulse, or which they begin nearer to each other than 1 mm (for small bodies less, by
/// halves, down to a hundredth of the smaller one's bounding radius), until a step in which it carries none and which
/// they begin farther apart than twice that. Falling asleep and waking do not change it.
struct ContactEvent {
  BodyId a;                ///< the one of the lower index
  BodyId b;                ///< the other
  std::uint64_t step = 0;  ///< `World::step_count()` after it
};
/// Two bodies that met faster than `SolverSettings::restitution_threshold`: a point of their contact approached faster
/// as the step began, and the contact stopped it or threw it back, whether they already touched elsewhere (a post that
/// falls over) or not. Each such impact is reported once, by its fastest point.
struct HitEvent {
  BodyId a;                    ///< the one of the lower index
  BodyId b;                    ///< the other
  Vec3 point;                  ///< m, world, where they met
  Vec3 normal;                 ///< unit, from a to b
  float approach_speed;        ///< m/s, as the step began
  std::uint32_t reserved = 0;  ///< padding
  std::uint64_t step = 0;      ///< `World::step_count()` after it
};

/// One contact point as solved in the last step.
struct ContactPointInfo {
  Vec3 position;     ///< m, world
  float separation;  ///< m, negative where the bodies overlap
  float impulse;     ///< N·s along the normal over the step; divided by dt the mean force (see ContactInfo)
};
/// A contact as solved in the last step. The points' impulses sum to the contact's impulse over the step; their shares
/// are those of the last substep.
struct ContactInfo {
  BodyId a;                    ///< the one of the lower index
  BodyId b;                    ///< the other
  Vec3 normal;                 ///< unit, from a to b
  int point_count = 0;         ///< how many of `points` count
  ContactPointInfo points[4];  ///< the contact points
  int colour = -1;             ///< of the constraint graph; −1 where the pair has none (asleep, or solved one by one)
  std::uint32_t child_a = 0;   ///< of a compound a: which child, see `Compound::children`
  std::uint32_t child_b = 0;   ///< of a compound b
};

/// A contact that is about to be solved (`World::set_pre_solve_callback`), as the step finds it: poses and velocities
/// of the world are those at the step's beginning. What the callback changes holds for this step, and as long as the
/// contact sleeps.
///
/// Contacts are asked about in every step in which one of their bodies is awake, from the step on that finds them near
/// enough to touch within it. A pair that touches in several parts, such as a compound, has a contact for each. Of a
/// fast body that would otherwise end behind another one (`BodyDef::bullet`) there may be no points, once the step is
/// solved: then `enabled` alone counts.
struct PreSolveContact {
  BodyId a;                    ///< the one of the lower index
  BodyId b;                    ///< the other
  std::uint32_t child_a = 0;   ///< see ContactInfo
  std::uint32_t child_b = 0;   ///< see ContactInfo
  Vec3 normal;                 ///< unit, from a to b
  int point_count = 0;         ///< how many of `points` count
  ContactPointInfo points[4];  ///< with the last step's impulses, 0 of what is new

  /// False: they do not collide in this step, and do not touch as events tell.
  bool enabled = true;
  float friction = 0;     ///< Coulomb coefficient of the two materials, ≥ 0
  float restitution = 0;  ///< 0 … 1, of the two materials
  /// m/s, world axes: at which b's surface moves against a's, besides their bodies' motion; of both materials
  /// (`Material::surface_velocity`), at most 1e6.
  Vec3 surface_velocity;
};

}  // namespace fathom
