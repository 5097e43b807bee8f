// Where the native simulator switches between ways of working, and how it divides work. Results do not depend on
// threads, so only the constants under "supports", "bouncing" and "narrow phase" change any bit of the state. Constants
// that all simulators share are in dynamics/tuning.hpp.
#pragma once

#include <cstddef>
#include <cstdint>

namespace fathom::native {

// --- how many threads a step is worth (`ThreadBudget::next`) ---------------------------------------------------------

inline constexpr double work_of_body = 60e-9;       ///< s per active body, about
inline constexpr double work_of_manifold = 200e-9;  ///< s per manifold, about
inline constexpr double work_of_joint = 400e-9;     ///< s per joint's sweeps, about: in nets 260 ns, in chains 1.1 µs
/// s per body of a directly solved mechanism, about: 3.6 µs in a chain, 20 in a ragdoll
/// (docs/log/2026-11-25-joints-beside-box3d.md).
inline constexpr double work_of_link = 4e-6;
/// s of work below which a step begins on one thread (docs/architecture.md, Threads).
inline constexpr double min_work_to_share = 80e-6;
inline constexpr double hopeless_a_thread = 10e-6;  ///< s of work below which another thread is not even tried
/// s that threads wait for each other at the end of a loop, about.
inline constexpr double waiting_a_loop = 2e-6;

// --- shares of a loop, small enough to balance and large enough to be worth a thread ---------------------------------

inline constexpr std::size_t bodies_a_thread = 64;       ///< bodies in contact, at least
inline constexpr std::size_t blocks_a_thread = 4;        ///< blocks of constraints, at least
inline constexpr std::size_t free_grain = 256;           ///< bodies without contacts per chunk
inline constexpr std::size_t min_queries_of_part = 64;   ///< rays or shapes of one call
inline constexpr std::size_t flags_grain = 512;          ///< bodies per chunk of a flag scan
inline constexpr std::size_t layout_grain = 512;         ///< bodies per chunk of the layout
inline constexpr std::size_t min_to_sort = 1024;         ///< lanes worth sorting on several threads
inline constexpr std::size_t min_to_share = 128;         ///< contacts or pairs worth changing on several threads
inline constexpr std::size_t min_stretches = 16;         ///< stretches worth copying on several threads
inline constexpr std::size_t min_slots_to_divide = 256;  ///< bodies worth dividing into domains on several threads
inline constexpr std::size_t placing_grain = 4096;       ///< contacts placed in domains, per chunk

/// Blocks of contacts whose changes the narrow phase lists: few enough for one thread to scan, enough to share out.
inline constexpr std::size_t max_blocks = 512;
inline constexpr std::size_t max_chunks_a_block = 8;  ///< of `contact_grain` contacts

// --- groups of islands and domains -----------------------------------------------------------------------------------

inline constexpr std::size_t min_to_group = 256;       ///< bodies of a scene that is divided into groups
inline constexpr std::size_t min_group_weight = 64;    ///< contacts of a group that fill its lanes well
inline constexpr std::size_t max_group_weight = 1024;  ///< contacts of a group that fit in the cache
inline constexpr std::size_t groups_a_thread = 4;      ///< leaves work for other threads to steal
inline constexpr std::size_t few_of_a_colour = 8;      ///< contacts, on average
/// Bodies that, with their contacts, stay in one thread's cache from sweep to sweep.
inline constexpr std::size_t cached_bodies = 2048;
/// Contacts between bodies of a heap that is solved in domains (docs/architecture.md, Threads).
inline constexpr std::uint64_t min_to_divide = 6000;
/// Weight in contacts of a body without any, in domains: it may yet get some.
inline constexpr float min_body_weight = 0.125f;

// --- supports --------------------------------------------------------------------------------------------------------

inline constexpr std::uint64_t levels_last = 16;  ///< steps for which levels are kept while no contact begins or ends
/// Steps between searches while contacts begin and end in every step and nothing is overloaded.
inline constexpr std::uint64_t steps_between_searches = 8;
/// Bodies farther from the ground than this are left to the sweeps (docs/log/2026-11-22-supports.md).
inline constexpr std::uint16_t max_levels = 1024;
/// Steps until structures are searched for again after all were collapsing.
inline constexpr std::uint64_t steps_to_resume = 8;

// --- bouncing --------------------------------------------------------------------------------------------------------

/// Maximum number of bounce sweeps per substep; the device, which plans its phases beforehand, makes
/// `max_bounce_sweeps`. Crowds of 512 and 1,728 elastic balls needed no more than eight, rows of 18 do.
inline constexpr int bounce_sweeps = 64;

// --- narrow phase ----------------------------------------------------------------------------------------------------

/// m of overlap that counts as faded away: below it a manifold may be recycled.
inline constexpr float overlap_gone = 1e-7f;

}  // namespace fathom::native
