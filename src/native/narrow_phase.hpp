// Brings contacts up to date with the poses of their bodies.
#pragma once

#include <span>
#include <vector>

#include "dynamics/look_ahead.hpp"
#include "native/body_state.hpp"
#include "native/box_pairs.hpp"
#include "native/contact.hpp"
#include "native/seams.hpp"

namespace fathom::native {

enum class Change : std::uint8_t {
  nothing,
  recycled,  ///< kept the last manifold: the bodies moved too little to matter
  began,     ///< touches now, did not before
  ended,     ///< touched before, does not now
  gone,      ///< the fat boxes parted; `remove` it
};

/// A manifold that has no slot yet, because only one thread may give it one.
struct NewManifold {
  /// Of a pair whose first contact this is, with this bit, a contact that is to be made (`ContactGraph::add_part`).
  static constexpr std::uint32_t new_part = 1u << 31;
  std::uint32_t contact;
  float ahead;  ///< s from the step's beginning to where it was made; below zero: as the bodies are
  Pose b_in_a;
  Manifold manifold;
  Children children{};  ///< of a new part
  AxisCache axis{};
  std::uint32_t answer = none;  ///< of the application (native/pre_solve.hpp), where it was asked
};

/// A pair of which a body moves fast for its size, as the step began. Where only one can be pushed it is B.
struct FastPair {
  std::uint32_t contact, a, b;
  Pose pose_a, pose_b;
  Apart first;
  Children children{};
};

/// Distance (m) that a contact's bodies, of which `children` touch, may move against each other before its manifold is
/// rebuilt.
float recycle_distance(const Contact& contact, Children children, const BodyTable& bodies);
/// The same as things are: 0 while the manifold is not to be kept.
inline float kept_within(const Contact& contact, Children children, const BodyTable& bodies) {
  return contact.slack.is_lifted() ? recycle_distance(contact, children, bodies) : contact.slack.recycle_distance();
}

/// What a contact needs before shapes are collided.
struct Inspection {
  Change change = Change::nothing;  ///< where `collide` is false
  bool collide = false;
  float margin = 0;  ///< m
  Pose b_in_a{};
  PatchLoad load{};
};
/// `children`: what touches in it.
Inspection inspect_contact(Contact& contact, const ContactManifold* manifold, const BodyTable& bodies,
                           const BodyState& state, float dt, Children children);
class ContactGraph;

/// What contacts are brought up to date with; lists are there to add to.
struct NarrowPhase {
  const BodyTable& bodies;
  const BodyState& state;
  float dt;
  std::vector<NewManifold>& begun;
  std::vector<FastPair>& fast;
  ContactGraph& graph;                      ///< parts of pairs
  std::vector<std::uint32_t>&ended, &gone;  ///< of these parts
  bool& has_new_parts;                      ///< some of `begun` are
  const Seams& seams;

  /// What follows from having collided with the result `fresh`: into the `manifold` of a touching contact, or into
  /// `begun`.
  Change take(std::uint32_t index, Contact& contact, const Manifold& fresh, const Inspection& seen,
              ContactManifold* manifold) const;

 private:
  Change take_fast(std::uint32_t index, Contact& contact, const Manifold& fresh, const Inspection& seen,
                   ContactManifold* manifold) const;
  friend class PartedPair;
  Change put(std::uint32_t index, Contact& contact, const Manifold& fresh, const Pose& b_in_a, float ahead,
             ContactManifold* manifold) const;
  /// What counts of it at seams.
  Change put_kept(std::uint32_t index, Contact& contact, const Manifold& fresh, const Pose& b_in_a, float ahead,
                  ContactManifold* manifold) const {
    if (fresh.count > 0 && contact.fixed_a && seams.may_have(contact.a)) [[unlikely]]
      return put_at_seam(index, contact, fresh, b_in_a, ahead, manifold);
    return put(index, contact, fresh, b_in_a, ahead, manifold);
  }
  Change put_at_seam(std::uint32_t index, Contact& contact, const Manifold& fresh, const Pose& b_in_a, float ahead,
                     ContactManifold* manifold) const;
};

/// Contacts that are brought up to date at once.
inline constexpr std::size_t contact_grain = BoxPairs::most;

/// `update_contact` of contacts [first, end), up to `contact_grain` of `contacts`, those of boxes that do not touch yet
/// side by side. changes[i] is what contact first + i has met. Contacts that nothing moves are left alone.
void update_contacts(std::span<Contact> contacts, std::uint32_t first, std::uint32_t end, ContactManifold* manifolds,
                     const NarrowPhase& narrow_phase, Change* changes);

/// The same of a pair that may touch in several parts, given by its first contact, and of all of these
/// (parted_pairs.cpp).
Change update_parts(std::uint32_t index, const NarrowPhase& narrow_phase);

/// Updates the contact's axis and, where it touches already, its `manifold`; puts a first manifold into `begun`
/// with contact index `index`. Writes nothing else.
Change update_contact(std::uint32_t index, Contact& contact, ContactManifold* manifold,
                      const NarrowPhase& narrow_phase);

}  // namespace fathom::native
