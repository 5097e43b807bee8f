// Tests pairs of boxes side by side in vector lanes: computes their relative poses, and which pairs a separating axis
// divides. The operations and their order are those of dynamics/manifold_update.hpp and collision/box_axes.hpp, so the
// results are bit-identical.
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

/// Sets a bit for each pair separated by more than its speculative margin. Such a pair's cache becomes what
/// `collide_boxes` would leave in it; other caches do not change. b_in_a[i] becomes `fathom::relative` of the poses of
/// pair i.
std::uint32_t separate_boxes(const BoxPairs& pairs, float dt, const BodyState& state, Pose* b_in_a, AxisCache* caches);

}  // namespace fathom::native
