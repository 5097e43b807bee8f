// Solves up to eight mechanisms of the same shape side by side in lanes.
//
// From the start of a step to its end, a batch stores the states of its mechanisms (dynamics/link_state-inl.hpp) with
// eight lanes in place of each number. The common work of a substep is done in lanes. A mechanism that needs anything
// else (`MechanismSolver::start_anew`, swings that a substep does not follow) is taken out of its lane, solved alone,
// and put back. Either way its result is bit-identical.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "dynamics/mechanism_link.hpp"
#include "dynamics/solver_body.hpp"
#include "dynamics/speed_limits.hpp"
#include "native/body_state.hpp"
#include "native/link_contacts.hpp"
#include "native/solver_kernels.hpp"

namespace fathom::native {

inline constexpr std::uint32_t mechanism_lanes = 8;

/// A bit for each lane.
using LaneBits = std::uint32_t;

struct MechanismBatch {
  std::span<const std::uint32_t> numbers;  ///< indices of mechanisms, one for each lane in use
  void* memory = nullptr;                  ///< `batch_bytes` of it, aligned to 32; null: each is solved alone
};

/// For mechanisms with so many links and generic joints.
std::size_t batch_bytes(std::uint32_t links, std::uint32_t generic);

class MechanismLanes {
 public:
  struct World {
    const Mechanism* mechanisms;
    const MechanismLink* links;
    LinkState* states;
    JointLink* generic;
    const BodyTable& bodies;
    BodyState& state;
    Constrained constrained;
    LinkContacts& contacts;
    float push_out;  ///< m/s
    SpeedLimits limits;
  };

  MechanismLanes(const World& world, const MechanismBatch& batch) : world_(world), batch_(batch) {}

  /// Copies the states of some lanes out, and back in.
  void take_out(LaneBits lanes) const;
  void bring_back(LaneBits lanes) const;

  // Like those of MechanismSolver, in substeps of length h (s). Some return the lanes that they took out unchanged,
  // which must be solved alone and brought back.
  void prepare() const;
  void store() const;
  LaneBits warm_start(float h) const;
  LaneBits pull_together(float h) const;
  LaneBits relax(float h) const;

 private:
  struct Work;
  struct Start;
  /// Lanes whose mechanisms solve contacts.
  LaneBits loaded() const;
  template <bool soft>
  void sweep_contacts(const Work& work, LaneBits lanes, float h) const;
  void store_impulses(LaneBits lanes, bool ends_substep) const;
  void take_back_contacts(LaneBits lanes) const;
  /// Those of the lowest lane.
  LinkContactRange contacts_of(LaneBits lanes) const;
  template <class Act>
  void each_lane(LaneBits lanes, const Act& act) const;
  const Mechanism& mechanism(std::uint32_t lane) const { return world_.mechanisms[batch_.numbers[lane]]; }

  World world_;
  MechanismBatch batch_;
};

}  // namespace fathom::native
