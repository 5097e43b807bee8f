// Mechanisms on the device: trees of joints that are solved directly (dynamics/mechanism.hpp). The host finds them
// whenever joints change (world/joint_trees.hpp); the device decides from their state which of them a step solves.
#pragma once

#include <cstdint>

#include "device/joint_arrays.hpp"
#include "dynamics/mechanism.hpp"

namespace fathom::device {

struct MechanismRecord {
  Mechanism tree{};
  std::uint32_t is_driven = 0;  ///< it has a drive
  // Valid within a step, zero between steps.
  std::uint32_t is_blocked = 0;   ///< 1: it sleeps, or one of its bodies is isolated
  std::uint32_t is_acted_on = 0;  ///< 1: something besides its own joints acts on one of its bodies

  /// Whether the step solves it directly.
  FATHOM_HD bool is_direct() const { return !is_blocked; }
  /// Whether its bodies swing: move by the mean of their velocities before and after gravity's acceleration. A
  /// mechanism with a body that rests on something would come to rest at the velocity that the others should have
  /// between positions; so would one with drives, which aim at a velocity.
  FATHOM_HD bool swings() const { return !is_driven && !is_acted_on; }
};

/// A link's contacts with obstacles that its mechanism solves (dynamics/link_contact.hpp). Valid within a step, zero
/// between steps.
struct LinkContacts {
  static constexpr std::uint32_t most = 8;  ///< sweeps alone solve those of a link with more

  std::uint32_t count;
  std::uint32_t leads;  ///< 1: the link, or one below it, has any
  std::uint32_t constraints[most];
};

/// Parts of the device's mechanism data, for `Mechanisms`.
enum MechanismPart : std::uint8_t { mechanism_tables, mechanism_records, mechanism_states };

/// Mechanisms; the parts `written` may be written (access.hpp). Worlds without mechanisms have no memory for them.
template <MechanismPart... written>
struct Mechanisms {
  template <class T, MechanismPart part>
  using Of = Array<T, part, written...>;

  Of<MechanismLink, mechanism_tables> links;  ///< bodies by device index, joints by slot
  Of<MechanismRecord, mechanism_records> records;
  Of<std::uint32_t, mechanism_tables> levels;
  Of<std::uint32_t, mechanism_tables> of_joint;  ///< by slot: the joint's mechanism, or `none`
  Of<std::uint32_t, mechanism_tables> of_body;   ///< by device index: the body's link, if `link_of` confirms it
  Of<LinkContacts, mechanism_records> contacts;  ///< by link
  Of<LinkState, mechanism_states> states;        ///< likewise
  Of<LinkPushes, mechanism_states> pushes;
  Of<JointLink, mechanism_states> generic;
  Of<float, mechanism_states> closures;  ///< memory of LoopClosures
  std::uint32_t capacity;                ///< of records
  std::uint32_t link_capacity;           ///< and of states
  std::uint32_t joint_capacity;          ///< of `of_joint`

  /// The body's link, or `none`; `count`: of all links.
  FATHOM_HD std::uint32_t link_of(std::uint32_t body, std::uint32_t count) const {
    const std::uint32_t i = of_body[body];
    return i < count && links[i].body == body && !links[i].is_copy() ? i : none;
  }
  /// Whether this step solves the joint in `slot` directly.
  FATHOM_HD bool is_direct(std::uint32_t slot) const {
    return capacity > 0 && of_joint[slot] != none && records[of_joint[slot]].is_direct();
  }

  template <MechanismPart... fewer>
  FATHOM_HD operator Mechanisms<fewer...>() const {
    static_assert((is_among<fewer, written...> && ...));
    return __builtin_bit_cast(Mechanisms<fewer...>, *this);
  }
};

using MechanismArrays = Mechanisms<mechanism_tables, mechanism_records, mechanism_states>;

/// All mechanisms, as found by the host.
struct MechanismTables {
  MechanismLink* links;
  MechanismRecord* records;
  std::uint32_t* levels;
  std::uint32_t* of_joint;
  std::uint32_t link_count, count, level_count, joint_count;
};

}  // namespace fathom::device
