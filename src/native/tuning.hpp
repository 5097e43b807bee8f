// Where the native simulator switches from one way of working to another, and how it divides work. None but those under
// "supports" and "narrow phase" changes a bit of any state: results do not depend on threads. What all simulators share
// is in dynamics/tuning.hpp.
#pragma once

#include <cstddef>
#include <cstdint>

namespace fathom::native {

// --- how many threads a step is worth (`ThreadBudget::next`) ---------------------------------------------------------

inline constexpr double work_of_body = 60e-9;       ///< s, of an active body, about
inline constexpr double work_of_manifold = 200e-9;  ///< s, of a manifold, about
inline constexpr double work_of_joint = 400e-9;  ///< s, of a joint's sweeps, about: of a net 260 ns, of chains 1.1 µs
/// s, of a body of a mechanism that is solved directly, about: of a chain 3.6 µs, of a ragdoll 20
/// (docs/performance.md).
inline constexpr double work_of_link = 4e-6;
/// s of work below which a step begins on one thread (docs/architecture.md, Threads).
inline constexpr double min_work_to_share = 80e-6;
inline constexpr double hopeless_a_thread = 10e-6;  ///< s of work for which another thread is not even tried
/// s that threads wait for each other at the end of a loop, about.
inline constexpr double waiting_a_loop = 2e-6;

// --- shares of a loop, small enough to balance and large enough to be worth a thread ---------------------------------

inline constexpr std::size_t bodies_a_thread = 64;       ///< bodies in contact, at least
inline constexpr std::size_t blocks_a_thread = 4;        ///< blocks of constraints, at least
inline constexpr std::size_t free_grain = 256;           ///< bodies without contacts, a chunk
inline constexpr std::size_t flags_grain = 512;          ///< bodies whose flags are looked through, a chunk
inline constexpr std::size_t layout_grain = 512;         ///< bodies that are laid out, a chunk
inline constexpr std::size_t min_to_sort = 1024;         ///< lanes that several threads sort
inline constexpr std::size_t min_to_share = 128;         ///< contacts or pairs that several threads change
inline constexpr std::size_t min_stretches = 16;         ///< stretches of them that several threads copy
inline constexpr std::size_t min_slots_to_divide = 256;  ///< bodies that several threads divide into domains
inline constexpr std::size_t placing_grain = 4096;       ///< contacts that are placed in domains, a chunk

/// Blocks of contacts whose changes the narrow phase lists: few enough to be looked through by one thread, enough to be
/// shared out.
inline constexpr std::size_t max_blocks = 512;
inline constexpr std::size_t max_chunks_a_block = 8;  ///< of `contact_grain` contacts

// --- groups of islands and domains -----------------------------------------------------------------------------------

inline constexpr std::size_t min_to_group = 256;       ///< bodies of a scene that is divided into groups
inline constexpr std::size_t min_group_weight = 64;    ///< contacts of a group, so that its lanes are well filled
inline constexpr std::size_t max_group_weight = 1024;  ///< contacts of a group, so that it stays in the cache
inline constexpr std::size_t groups_a_thread = 4;      ///< so that others can help
inline constexpr std::size_t few_of_a_colour = 8;      ///< contacts, on average
/// Bodies that one thread keeps in its cache from sweep to sweep with their contacts.
inline constexpr std::size_t cached_bodies = 2048;
/// Contacts between bodies of a heap that is solved in domains (docs/architecture.md, Threads).
inline constexpr std::uint64_t min_to_divide = 6000;
/// Contacts' worth that a body without any counts for in domains: it may yet get some.
inline constexpr float min_body_weight = 0.125f;

// --- supports --------------------------------------------------------------------------------------------------------

inline constexpr std::uint64_t levels_last = 16;  ///< steps, while no contact begins or ends
/// Steps. While contacts begin and end in every step, and nothing is overloaded, they need not be looked through each
/// time.
inline constexpr std::uint64_t steps_between_searches = 8;
/// Bodies farther from the ground than this are left to the sweeps (docs/log/2026-11-22-supports.md).
inline constexpr std::uint16_t max_levels = 1024;
/// J/kg above which a structure is coming down, and is left to the sweeps.
inline constexpr float calm_energy = 0.1f;
/// Steps after which structures are looked for again where all were coming down.
inline constexpr std::uint64_t steps_to_resume = 8;
/// Steps after which a structure that could not be held is tried again: an arch stands by its thrust, which sweeps
/// find.
inline constexpr std::uint64_t steps_to_retry = 64;

// --- narrow phase ----------------------------------------------------------------------------------------------------

/// m of overlap that have as good as faded away: from there on a manifold may be recycled.
inline constexpr float overlap_gone = 1e-7f;

}  // namespace fathom::native
