// Contacts that a lasting load presses deep. Pure, for host and device.
//
// A contact is a spring tuned to its own two bodies' masses. Under many times their weight it sags many times as far,
// and neither more sweeps nor more substeps change that: this is the spring's rest position. A contact that stays deep
// therefore counts as deeper still, by a *lift* that grows meanwhile: the integral term of a controller. It is slow
// compared with everything else that contacts do, so a heavy body does not bob on light ones, and it leaves their
// damping unchanged. Springs stay soft against hits: the lift of bodies whose relative speed exceeds `pressed_speed`
// stays constant, or whatever a falling tower compresses would throw it up again.
#pragma once

#include <fathom/math.hpp>

#include "dynamics/tuning.hpp"

namespace fathom {

/// Depth (m) that a contact may keep; `half_thickness` (m) is that of its thinner body.
FATHOM_HD float lasting_depth(float half_thickness) {
  return min(max(lasting_depth_share * half_thickness, min_lasting_depth), max_lasting_depth_share * half_thickness);
}

/// A contact's lift (m) after a step of `dt` (s), at the end of which its deepest point was `depth` (m) deep and it
/// carried `load` times its own bodies' weight. The lift grows beyond the lasting depth, fades below half of it and
/// stays constant in between; it is gone once the bodies part. It grows more slowly under larger loads, because a
/// heavier load responds more slowly.
FATHOM_HD float next_lift(float lift, float depth, float load, float half_thickness, float dt) {
  const float lasting = lasting_depth(half_thickness);
  if (!(depth >= 0)) return 0;
  if (depth > lasting) {
    const float rate = lift_rate * min(1.0f, light_load / load);
    return min(fma(rate * dt, depth - lasting, lift), half_thickness);
  }
  if (depth >= 0.5f * lasting) return lift;
  const float kept = lift * max(1 - lift_fading * dt, 0.0f);
  return kept > lift_gone ? kept : 0.0f;
}

}  // namespace fathom
