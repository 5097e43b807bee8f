// Surfaces that move relative to their bodies, such as conveyor belts and tracks (`Material::surface_velocity`). Pure,
// for host and device.
//
// Friction brakes the sliding velocity of B against A at the contact's centre. A moving surface's velocity relative to
// its body is part of it: friction accelerates bodies on a belt to the belt's speed and pushes the belt's body the
// other way. It is constant over a step. Few contacts have one, so it is stored apart from other rows.
#pragma once

#include <fathom/math.hpp>

#include "dynamics/tuning.hpp"

namespace fathom {

/// Whether a surface carries a body that moves at `velocity` (m/s, B against A), which then must not fall asleep
/// however slow it is. `slide` is the surfaces' contribution to B's sliding velocity against A (m/s). A body held in
/// place may fall asleep, though the surface slides on below it.
FATHOM_HD bool goes_with_surface(Vec3 slide, Vec3 velocity) {
  const float squared = length_squared(slide);
  return -dot(slide, velocity) > min(0.5f * squared, min_speed_with_surface * fathom::sqrt(squared));
}

/// Whether the contact's normal is nearly perpendicular to `slide`, so that the surface may carry a body.
FATHOM_HD bool is_along_surface(Vec3 slide, Vec3 normal) {
  const float across = dot(slide, normal);
  return across * across <= max_sine_to_surface * max_sine_to_surface * length_squared(slide);
}

}  // namespace fathom
