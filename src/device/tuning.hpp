// Work division and initial capacities of the device simulator. Only the constants under "behaviour of a step" affect
// any bit of the state. Constants that all simulators share are in dynamics/tuning.hpp; work-group sizes are with the
// kernels.
#pragma once

#include <cstddef>
#include <cstdint>

namespace fathom::device {

// --- behaviour of a step ---------------------------------------------------------------------------------------------

/// Each round colours at most one new contact per body. At the foot of a crushed tower, bodies begin about fifty
/// contacts in one step.
inline constexpr std::uint32_t colouring_rounds = 200;
/// Bodies farther from the ground than this are left to sweeps: every level is a solver phase.
inline constexpr std::uint32_t max_levels = 256;
/// Levels are determined again at least once in this many steps.
inline constexpr std::uint32_t levels_last = 16;

// --- shares of a kernel ----------------------------------------------------------------------------------------------

inline constexpr std::uint32_t search_group_bodies = 16;    ///< bodies per work-group of the search
inline constexpr std::uint32_t constraint_group_size = 64;  ///< work-items per work-group that prepares constraints

// --- what goes to the device and comes back --------------------------------------------------------------------------

/// Maximum steps in flight, unless more are requested: enough to keep a GPU busy.
inline constexpr int min_in_flight = 3;
/// Number of edits uploaded at once while the application still makes more.
inline constexpr std::size_t edits_at_once = 4096;
/// Events of each list that are copied along with a step's results.
inline constexpr std::size_t first_events = 1024;
/// Pairs of the hybrid simulator that are copied with the report: a step with few pairs then waits only once.
inline constexpr std::uint32_t prefetched_pairs = 1024;

/// Queries of one call that are worth sending to the device, and those sent at once.
inline constexpr std::size_t min_device_queries = 256, max_queries_of_batch = std::size_t{1} << 17;
/// Overlaps of a batch that there is room for at first, for each query, and most: with more, batches are smaller.
inline constexpr std::size_t first_overlaps_per_query = 4, max_overlaps_of_batch = std::size_t{1} << 22;

// --- room to begin with ----------------------------------------------------------------------------------------------

inline constexpr std::size_t first_bodies = 256;
inline constexpr std::size_t first_contacts = 1024;

/// Room for so many triangles near each pair with a surface, and touches with them. Pairs that find none are left to
/// teams, on a GPU and on the threads of a host, which takes them longer. Results do not depend on these.
inline constexpr std::size_t surface_entries_per_pair = 32, surface_touches_per_pair = 12;
inline constexpr std::uint32_t surface_teams_of_gpu = 2048, surface_teams_of_host = 64;

}  // namespace fathom::device
