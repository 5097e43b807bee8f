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
  std::uint32_t stands = 0;       ///< 1: a joint holds it to an obstacle, or it solves a contact with one
  // Mechanisms that push the same free bodies are one cluster. The one with the smallest number leads it: its team
  // solves them one after the other. A cluster that is too large leaves its contacts with free bodies to sweeps.
  std::uint32_t leader = none;     ///< number of that mechanism; none: it pushes no free body
  std::uint32_t cluster_size = 0;  ///< of a leader
  std::uint32_t cluster[max_cluster] = {};

  /// Whether the step solves it directly.
  FATHOM_HD bool is_direct() const { return !is_blocked; }
  FATHOM_HD bool has_small_cluster() const { return cluster_size <= max_cluster; }
  /// Whether its bodies swing: move by the mean of their velocities before and after gravity's acceleration. A
  /// mechanism with a body that rests on something would come to rest at the velocity that the others should have
  /// between positions; so would one with drives, which aim at a velocity.
  FATHOM_HD bool swings() const { return !is_driven && !is_acted_on; }
};

/// A link's contacts that its mechanism solves (dynamics/link_contact.hpp). Valid within a step, zero between steps.
struct LinkContacts {
  static constexpr std::uint32_t most = 8;  ///< sweeps alone solve those of a link with more

  std::uint32_t count;
  std::uint32_t leads;  ///< 1: the link, or one below it, has any
  std::uint32_t constraints[most];
};

/// State of one of these contacts while its mechanism sweeps over it.
struct LinkContactState {
  ContactImpulses impulses;
  LinkContactMasses masses;
  float sum;        ///< N·s, of the points before the sweeps
  Velocity before;  ///< of the other body, likewise
};

struct LinkContactStates {
  LinkContactState contacts[LinkContacts::most];
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
  Of<std::uint32_t, mechanism_tables> of_joint;    ///< by slot: the joint's mechanism, or `none`
  Of<std::uint32_t, mechanism_tables> of_body;     ///< by device index: the body's link, if `link_of` confirms it
  Of<std::uint32_t, mechanism_records> pushed_by;  ///< by device index, of a free body: the first that pushes it
  Of<std::uint32_t, mechanism_records> parents;    ///< by mechanism: towards the leader of its cluster
  Of<LinkContacts, mechanism_records> contacts;    ///< by link
  Of<LinkContactStates, mechanism_states> contact_states;  ///< likewise
  Of<LinkState, mechanism_states> states;                  ///< likewise
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
  /// Whether a mechanism solves contact constraint k, with these bodies; `count`: of all links.
  FATHOM_HD bool solves(std::uint32_t k, std::uint32_t a, std::uint32_t b, std::uint32_t count) const {
    return capacity > 0 && (solves(k, link_of(a, count)) || solves(k, link_of(b, count)));
  }
  FATHOM_HD bool solves(std::uint32_t k, std::uint32_t link) const {
    if (link == none) return false;
    const LinkContacts& list = contacts[link];
    bool does = false;
    for (std::uint32_t n = 0; n < list.count; ++n) does = does || list.constraints[n] == k;
    return does;
  }
  /// Whether the body is a link of a mechanism that stands on something; `count`: of all links.
  FATHOM_HD bool stands(std::uint32_t body, std::uint32_t count) const {
    const std::uint32_t link = capacity > 0 ? link_of(body, count) : none;
    return link != none && records[links[link].mechanism].stands != 0;
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
