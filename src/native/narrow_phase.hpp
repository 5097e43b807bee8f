// Brings one contact's manifold up to date with the poses of its bodies.
#pragma once

#include "native/body_state.hpp"
#include "native/contact.hpp"

namespace fathom::native {

enum class Change : std::uint8_t {
  nothing,
  recycled,  ///< kept the last manifold: the bodies moved too little to matter
  began,     ///< touches now, did not before
  ended,     ///< touched before, does not now
  gone,      ///< the fat boxes parted; `remove` it
};

/// Updates points, anchors and impulses of the contact. Writes nothing but the contact.
Change update_contact(Contact& contact, const BodyTable& bodies, const BodyState& state, float dt);

}  // namespace fathom::native
