// What every random heap must fulfil, whatever its contents.
#pragma once

#include <cstdint>
#include <string>

#include "scene/heap.hpp"
#include "validate/record.hpp"
#include "validate/setup.hpp"

namespace fathom::validate {

/// Simulates the heap and checks everything that applies to its kind. Checks have the same names for all heaps of a
/// case. The simulation stops when a heap loses a body. Checks that some heaps are known to fail say so
/// (docs/validation.md counts them).
Record judge_heap(const Heap& heap, const Setup& setup);

/// The command that shows a heap of that name ("heap", "surface_heap", "joint_heap").
std::string view_command(const std::string& name, std::uint64_t seed, const Setup& setup);

}  // namespace fathom::validate
