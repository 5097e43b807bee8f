// What bounds a joint's sweep where its bodies move farther in a substep than its rows, which are linear, can tell.
#pragma once

namespace fathom {

/// Angle (rad) of a substep beyond which the second order says nothing of where an anchor gets to.
inline constexpr float max_drift = 0.7f;
/// Angle (rad) of a substep by which the last substep's impulses may turn a body more or less than they did, because
/// the arms have turned since. Of a body that is light about its anchor's arm more would say nothing of what holds now:
/// such impulses count less, and the sweep finds them anew.
inline constexpr float max_carry = 0.05f;
/// Speed (m/s) at which a rigid joint closes its gap at most.
inline constexpr float max_pull = 60;

}  // namespace fathom
