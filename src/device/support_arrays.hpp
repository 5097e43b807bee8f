// Data of bodies, contacts and structures for the direct solution of supports (dynamics/support.hpp).
#pragma once

#include <cstdint>

#include "device/tuning.hpp"
#include "dynamics/overload.hpp"
#include "dynamics/support.hpp"

namespace fathom::device {

/// Entries of lists by level: from level 0 to one past the last.
inline constexpr std::uint32_t level_slots = max_levels + 2;

/// `BodySupport::held` of a body that has just been placed: it starts as if it had been held, or springs would first
/// yield.
inline constexpr float was_placed = 2;

/// The inertia that loads on a body want for it (dynamics/overload.hpp). Outlasts a step.
struct BodyLoad {
  std::uint32_t now = 0;  ///< maximum that contacts want in this step, as bits; 0: none is overloaded
  float before = 0;       ///< … in the step before
  float inertia_scale = 1;
};

/// A body as part of a structure, and its load. Outlasts a step.
struct alignas(16) BodySupport {
  BodyLoad load;
  std::uint32_t overloaded = 0xffffffff;  ///< last step in which one of its contacts was overloaded
  std::uint32_t level = 0;  ///< number of pressing contacts on the shortest path to what cannot be pushed; 0: unknown
  std::uint32_t structure = 0;  ///< least index among bodies that press on each other, within a step
  float held = 0;               ///< fraction of the last direct solution, 0 without one
  float heaviest = 0;           ///< kg, of the structure's bodies when structures were last determined
  BaseMotion base;              ///< of what its structure stands on; noted while the body has added inertia
  OwedMomentum owed;
};

/// A body's node in the graph of supports, within a step.
struct alignas(16) SupportNode {
  Triangle6 factor;          ///< of the rows of its supports
  std::uint32_t first;       ///< of its contacts in `contacts_of`
  std::uint32_t contacts;    ///< number of contacts with a colour
  std::uint32_t supports;    ///< number of supports, which come first among them; 0: the body is not held
  float held;                ///< fraction of this step's last direct solution
  std::uint32_t changed;     ///< 1 + the last round that changed whether the body is held; 0: none
  std::uint32_t is_settled;  ///< 1: moves little relative to what its structure rests on

  FATHOM_HD bool is_held() const { return supports > 0; }
};

/// Effect of one direct solution on a body.
struct alignas(16) SupportMove {
  Vec3 linear;  ///< m/s
  float slope;
  Vec3 angular;  ///< rad/s
  float curvature;
  float energy;     ///< twice the body's kinetic energy relative to the common motion (J)
  float reference;  ///< twice that of a fall through a substep (J)
};

/// Sums over a structure, in integers: they do not depend on the order of terms.
struct alignas(16) Structure {
  std::uint32_t overloaded = 0;             ///< 1: some contact was overloaded in the previous step
  std::uint32_t first_base = 0xffffffff;    ///< least index of the moving bodies that it rests on
  std::uint32_t first_motion = 0xffffffff;  ///< least and greatest of their `motion_key`s
  std::uint32_t last_motion = 0;
  std::uint32_t rests_on_still = 0;                 ///< 1: it rests on something at rest
  std::uint32_t heaviest = 0;                       ///< kg, as bits
  std::uint32_t largest = 0;                        ///< largest term of a direct solution's sums, as bits
  std::uint32_t held_back[2] = {};                  ///< of alternate direct solutions: most that `calm_part` takes off
  std::uint64_t mass = 0, energy = 0;               ///< see `add_energy`
  std::uint64_t slope[2] = {}, curvature[2] = {};   ///< sums of alternate direct solutions
  std::uint64_t excess[2] = {}, reference[2] = {};  ///< the same, of `SupportMove::energy` and `reference`

  FATHOM_HD bool has_moving_base() const { return first_base != 0xffffffff; }
  /// Whether everything that it rests on moves as one.
  FATHOM_HD bool has_one_base() const { return !has_moving_base() || (first_motion == last_motion && !rests_on_still); }
};

/// Which body of a contact stands on the other.
enum UpperBody : std::uint32_t { no_upper, upper_a, upper_b };

/// A contact as a support, within a step.
struct alignas(16) SupportRecord {
  float weight[max_manifold_points];
  SupportChange change;
  Wrench wrench;  ///< on the upper body, about the contact's centre
  float slide_weight, max_load;
  std::uint32_t upper;  ///< UpperBody
};

}  // namespace fathom::device
