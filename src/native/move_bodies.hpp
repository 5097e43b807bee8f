// The last loop of a step: moves every active body to its new pose, velocity and box, eight bodies at a time.
#pragma once

#include <cstdint>
#include <fathom/world.hpp>
#include <mutex>
#include <span>
#include <vector>

#include "dynamics/speed_limits.hpp"
#include "native/body_state.hpp"

namespace fathom::native {

/// Bodies that left the path predicted by their velocity, beyond the range searched for pairs, because of what they
/// hit, other bodies or forces.
struct Strays {
  struct Stray {
    std::uint32_t slot;
    Pose begin;
  };
  std::vector<Stray> list;  ///< in any order
  std::mutex mutex;
};

struct MoveParameters {
  Vec3 gravity;
  float dt = 0;
  int substeps = 1;
  SpeedLimits limits;
  bool sleeping = false;     ///< accumulate the time for which bodies have been slow
  float slow_below = 0;      ///< m/s
  bool forced = false;       ///< the application's forces act on some body
  bool jointed = false;      ///< some body has joints
  bool scattered = false;    ///< slots are not in memory order
  Strays* strays = nullptr;  ///< null: strays are not listed
};

/// Moves bodies by the solver's result (`in_contact`), or bodies without contacts through all substeps. Returns how
/// many have a state that is not finite; those keep their old pose and get the flag `isolated`. Bodies whose new box
/// leaves their fat box get a new one and the flag `box_changed`.
template <bool in_contact>
std::size_t move_bodies(std::span<const std::uint32_t> slots, const BodyTable& bodies, BodyState& state,
                        const MoveParameters& p);

}  // namespace fathom::native
