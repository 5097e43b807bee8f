// What bounds a joint's sweep where its bodies move farther in a substep than its rows, which are linear, can tell.
#pragma once

namespace fathom {

/// Angle (rad) of a substep beyond which the second order says nothing of where an anchor gets to.
inline constexpr float most_drift = 0.7f;
/// Speed (m/s) at which a rigid joint closes its gap at most.
inline constexpr float most_pull = 60;

}  // namespace fathom
