// Mechanisms on the device: trees of joints that are solved directly (dynamics/mechanism.hpp). The host finds them
// whenever joints change (world/joint_trees.hpp); which of them a step solves, the device sees by their state.
#pragma once

#include <cstdint>

#include "device/joint_arrays.hpp"
#include "dynamics/mechanism.hpp"

namespace fathom::device {

struct MechanismRecord {
  Mechanism tree{};
  float mass = 0;               ///< kg, of all of it
  std::uint32_t is_driven = 0;  ///< some drive moves it
  // Of a step, and zero between steps.
  std::uint32_t is_blocked = 0;        ///< 1: it sleeps, has parted, or a body of it is isolated
  std::uint32_t lightest_inverse = 0;  ///< 1/kg, as bits: of its lightest body that touches something

  /// Whether the step solves it directly.
  FATHOM_HD bool is_direct() const {
    return !is_blocked && mass * __builtin_bit_cast(float, lightest_inverse) <= max_behind_a_contact;
  }
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
