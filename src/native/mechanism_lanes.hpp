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

struct MechanismWorld {
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

/// Lanes of which the rest is to be done alone.
struct LanesAlone {
  LaneBits anew;   ///< they were taken out unchanged
  LaneBits apart;  ///< the substep of these does not make anchors meet (`MechanismSolver::come_to_rest_anew`)
};

/// The functions of MechanismLanes for one instruction set.
struct LaneFunctions {
  void (*take_out)(const MechanismWorld&, const MechanismBatch&, LaneBits);
  void (*bring_back)(const MechanismWorld&, const MechanismBatch&, LaneBits);
  void (*prepare)(const MechanismWorld&, const MechanismBatch&);
  void (*store)(const MechanismWorld&, const MechanismBatch&);
  LaneBits (*warm_start)(const MechanismWorld&, const MechanismBatch&, float);
  LanesAlone (*pull_together)(const MechanismWorld&, const MechanismBatch&, float);
  LaneBits (*relax)(const MechanismWorld&, const MechanismBatch&, float);
};
/// For that of `wide_kernels`.
const LaneFunctions& lane_functions();

class MechanismLanes {
 public:
  MechanismLanes(const MechanismWorld& world, const MechanismBatch& batch) : world_(world), batch_(batch) {}

  /// Copies the states of some lanes out, and back in.
  void take_out(LaneBits lanes) const { functions_.take_out(world_, batch_, lanes); }
  void bring_back(LaneBits lanes) const { functions_.bring_back(world_, batch_, lanes); }

  // Like those of MechanismSolver, in substeps of length h (s). Some return the lanes that they took out, which must be
  // solved alone and brought back: unchanged, or with drives that `relax` has put at their largest force.
  void prepare() const { functions_.prepare(world_, batch_); }
  void store() const { functions_.store(world_, batch_); }
  LaneBits warm_start(float h) const { return functions_.warm_start(world_, batch_, h); }
  LanesAlone pull_together(float h) const { return functions_.pull_together(world_, batch_, h); }
  LaneBits relax(float h) const { return functions_.relax(world_, batch_, h); }

 private:
  MechanismWorld world_;
  MechanismBatch batch_;
  const LaneFunctions& functions_ = lane_functions();
};

}  // namespace fathom::native
