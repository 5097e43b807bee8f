// Mechanisms on the device: trees of joints that are solved directly (dynamics/mechanism.hpp). The host finds them
// whenever joints change (world/joint_trees.hpp); which of them a step solves, the device sees by their state.
#pragma once

#include <cstdint>

#include "device/joint_arrays.hpp"
#include "dynamics/mechanism.hpp"

namespace fathom::device {

struct MechanismRecord {
  Mechanism tree{};
  std::uint32_t is_driven = 0;  ///< some drive moves it
  std::uint32_t is_blocked = 0;  ///< of a step, zero between steps: 1: it sleeps, or a body of it is isolated

  /// Whether the step solves it directly.
  FATHOM_HD bool is_direct() const { return !is_blocked; }
};

/// Worlds without mechanisms have no memory for any.
struct MechanismArrays {
  MechanismLink* links;  ///< bodies by device index, joints by slot
  MechanismRecord* records;
  std::uint32_t* levels;
  std::uint32_t* of_joint;  ///< by slot: the mechanism that the joint is of, or `none`
  LinkState* states;        ///< by link
  JointLink* generic;
  std::uint32_t capacity;        ///< of records
  std::uint32_t link_capacity;   ///< and states, and levels
  std::uint32_t joint_capacity;  ///< of `of_joint`

  /// Whether this step solves the joint in `slot` directly.
  FATHOM_HD bool is_direct(std::uint32_t slot) const {
    return capacity > 0 && of_joint[slot] != none && records[of_joint[slot]].is_direct();
  }
};

/// All mechanisms, as the host has found them.
struct MechanismTables {
  MechanismLink* links;
  MechanismRecord* records;
  std::uint32_t* levels;
  std::uint32_t* of_joint;
  std::uint32_t link_count, count, level_count, joint_count;
};

}  // namespace fathom::device
