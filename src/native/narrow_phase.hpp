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
  began,     ///< began to touch
  ended,     ///< stopped touching
  gone,      ///< the fat boxes parted; `remove` it
};

/// A manifold without a slot yet, because only one thread may assign slots.
struct NewManifold {
  /// With this bit, `contact` is the first contact of a pair and a new part is to be made (`ContactGraph::add_part`).
  static constexpr std::uint32_t new_part = 1u << 31;
  std::uint32_t contact;
  float ahead;  ///< s from the start of the step at which it was made; below zero: at the current poses
  Pose b_in_a;
  Manifold manifold;
  Children children{};  ///< of a new part
  AxisCache axis{};
  std::uint32_t answer = none;  ///< of the application (native/pre_solve.hpp), if it was asked
};

/// A pair with a body that moves fast for its size, as the step began. If only one can be pushed, it is B.
struct FastPair {
  std::uint32_t contact, a, b;
  Pose pose_a, pose_b;
  Apart first;
  Children children{};
  Aabb clear{{}, {-1, -1, -1}};  ///< m, in A's frame: no triangle of a surface A meets it; empty if that is unknown
};

/// Distance (m) that a contact's bodies, with `children` touching, may move relative to each other before its manifold
/// is rebuilt.
float recycle_distance(const Contact& contact, Children children, const BodyTable& bodies);
/// The same in the contact's current state: 0 if the manifold must not be kept.
inline float kept_within(const Contact& contact, Children children, const BodyTable& bodies) {
  return contact.slack.is_lifted() ? recycle_distance(contact, children, bodies) : contact.slack.recycle_distance();
}

/// What a contact needs before its shapes are collided.
struct Inspection {
  Change change = Change::nothing;  ///< where `collide` is false
  bool collide = false;
  float margin = 0;  ///< m
  Pose b_in_a{};
  PatchLoad load{};
};
/// `children`: those that touch in the contact.
Inspection inspect_contact(Contact& contact, const ContactManifold* manifold, const BodyTable& bodies,
                           const BodyState& state, float dt, Children children);
class ContactGraph;

/// What contacts are updated with; the lists are appended to.
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

  /// Applies the collision's result `fresh` to the `manifold` of a touching contact, or appends it to `begun`.
  Change take(std::uint32_t index, Contact& contact, const Manifold& fresh, const Inspection& seen,
              ContactManifold* manifold) const;

 private:
  Change take_fast(std::uint32_t index, Contact& contact, const Manifold& fresh, const Inspection& seen,
                   ContactManifold* manifold) const;
  friend class PartedPair;
  Change put(std::uint32_t index, Contact& contact, const Manifold& fresh, const Pose& b_in_a, float ahead,
             ContactManifold* manifold) const;
  /// Applies the part of it that counts at seams.
  Change put_kept(std::uint32_t index, Contact& contact, const Manifold& fresh, const Pose& b_in_a, float ahead,
                  ContactManifold* manifold) const {
    if (fresh.count > 0 && contact.fixed_a && seams.may_have(contact.a)) [[unlikely]]
      return put_at_seam(index, contact, fresh, b_in_a, ahead, manifold);
    return put(index, contact, fresh, b_in_a, ahead, manifold);
  }
  Change put_at_seam(std::uint32_t index, Contact& contact, const Manifold& fresh, const Pose& b_in_a, float ahead,
                     ContactManifold* manifold) const;
};

/// Contacts that are updated at once.
inline constexpr std::size_t contact_grain = BoxPairs::most;

/// `update_contact` of contacts [first, end), up to `contact_grain` of `contacts`. Boxes that do not touch yet are
/// tested side by side. changes[i] is what happened to contact first + i. Skips contacts that nothing moves.
void update_contacts(std::span<Contact> contacts, std::uint32_t first, std::uint32_t end, ContactManifold* manifolds,
                     const NarrowPhase& narrow_phase, Change* changes);

/// The same for all parts of a pair that may touch in several parts, given by its first contact (parted_pairs.cpp).
Change update_parts(std::uint32_t index, const NarrowPhase& narrow_phase);

/// Updates the contact's axis and, if it already touches, its `manifold`. Appends a first manifold to `begun` with
/// contact index `index`. Writes nothing else.
Change update_contact(std::uint32_t index, Contact& contact, ContactManifold* manifold,
                      const NarrowPhase& narrow_phase);

}  // namespace fathom::native
