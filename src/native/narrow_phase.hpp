// Brings contacts up to date with the poses of their bodies.
#pragma once

#include <span>
#include <vector>

#include "native/body_state.hpp"
#include "native/box_pairs.hpp"
#include "native/contact.hpp"

namespace fathom::native {

enum class Change : std::uint8_t {
  nothing,
  recycled,  ///< kept the last manifold: the bodies moved too little to matter
  began,     ///< touches now, did not before
  ended,     ///< touched before, does not now
  gone,      ///< the fat boxes parted; `remove` it
};

/// A manifold that has no place yet, because only one thread may give it one.
struct NewManifold {
  std::uint32_t contact;
  Pose b_in_a;
  Manifold manifold;
};

/// Distance (m) that two bodies may move against each other before their manifold is made anew.
float recycle_distance(const BodyInfo& a, const BodyInfo& b);

/// What a contact needs before shapes are collided.
struct Inspection {
  Change change = Change::nothing;  ///< where `collide` is false
  bool collide = false;
  float margin = 0;  ///< m
  Pose b_in_a{};
};
Inspection inspect_contact(Contact& contact, const ContactManifold* manifold, const BodyTable& bodies,
                           const BodyState& state, float dt);
/// What follows from having collided: into the `manifold` of a touching contact, or into `begun`.
Change take_manifold(std::uint32_t index, const Manifold& fresh, const Pose& b_in_a, ContactManifold* manifold,
                     std::vector<NewManifold>& begun);

/// Contacts that are brought up to date at once.
inline constexpr std::size_t contact_grain = BoxPairs::most;

/// `update_contact` of contacts [first, end), up to `contact_grain` of `contacts`, those of boxes that do not touch yet
/// side by side. changes[i] is what contact first + i has met. Contacts that nothing moves are left alone.
void update_contacts(std::span<Contact> contacts, std::uint32_t first, std::uint32_t end, ContactManifold* manifolds,
                     const BodyTable& bodies, const BodyState& state, float dt, std::vector<NewManifold>& begun,
                     Change* changes);

/// Updates the contact's axis and, where it touches already, its `manifold`; puts a first manifold into `begun`
/// with contact index `index`. Writes nothing else.
Change update_contact(std::uint32_t index, Contact& contact, ContactManifold* manifold, const BodyTable& bodies,
                      const BodyState& state, float dt, std::vector<NewManifold>& begun);

}  // namespace fathom::native
