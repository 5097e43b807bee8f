// Pairs of boxes side by side in vector lanes: where they are from each other, and which of them an axis separates. The
// same operations as in dynamics/manifold_update.hpp and collision/box_axes.hpp, in the same order, so that the results
// are the same bits.
#pragma once

#include <cstdint>

#include "native/body_state.hpp"
#include "native/contact.hpp"

namespace fathom::native {

/// Up to `most` pairs, by the slots of their bodies.
struct BoxPairs {
  static constexpr std::size_t most = 32;

  std::uint32_t a[most], b[most];
  std::size_t count = 0;
};

/// A bit for each pair that is farther apart than its speculative margin. Its cache then is what `collide_boxes` leaves
/// in it; that of others is as before. b_in_a[i] becomes `fathom::relative` of the poses of pair i.
std::uint32_t separate_boxes(const BoxPairs& pairs, float dt, const BodyState& state, Pose* b_in_a, AxisCache* caches);

}  // namespace fathom::native
