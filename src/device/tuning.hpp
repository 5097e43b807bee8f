// How the device simulator divides work, and what it begins with. None but those under "what a step does" changes a bit
// of any state. What all simulators share is in dynamics/tuning.hpp; the size of a kernel's work-groups is with the
// kernel.
#pragma once

#include <cstddef>
#include <cstdint>

namespace fathom::device {

// --- what a step does ------------------------------------------------------------------------------------------------

/// Every round colours one new contact of a body at most. In the foot of a tower that is crushed bodies begin some
/// fifty contacts in one step.
inline constexpr std::uint32_t colouring_rounds = 200;
/// Bodies farther from the ground than this are left to the sweeps: every level is a phase of the solver.
inline constexpr std::uint32_t max_levels = 256;
/// Levels are found again once in so many steps at least.
inline constexpr std::uint32_t levels_last = 16;

// --- shares of a kernel ----------------------------------------------------------------------------------------------

inline constexpr std::uint32_t search_group_bodies = 16;    ///< bodies that a work-group of the search looks after
inline constexpr std::uint32_t constraint_group_size = 64;  ///< work-items that prepare constraints together

// --- what goes to the device and comes back --------------------------------------------------------------------------

/// Steps in flight at most, beside those asked for: enough to keep a GPU busy.
inline constexpr int min_in_flight = 3;
/// Edits that go to the device at once while the application still makes more.
inline constexpr std::size_t edits_at_once = 4096;
/// Events of each list that a step's results bring along without being asked twice.
inline constexpr std::size_t first_events = 1024;
/// Pairs of the hybrid simulator that come along with the report, so that a step with few waits once.
inline constexpr std::uint32_t prefetched_pairs = 1024;

// --- room to begin with ----------------------------------------------------------------------------------------------

inline constexpr std::size_t first_bodies = 256;
inline constexpr std::size_t first_contacts = 1024;

}  // namespace fathom::device
