// What must hold in every random heap, whatever is in it.
#pragma once

#include <cstdint>
#include <string>

#include "scene/heap.hpp"
#include "validate/record.hpp"
#include "validate/setup.hpp"

namespace fathom::validate {

/// Simulates the heap and checks what can be asked of one of its kind. Names of checks are the same for all heaps of a
/// case. A heap that loses a body is not simulated to its end. Checks that some heaps are known to fail say so
/// (docs/validation.md counts them).
Record judge_heap(const Heap& heap, const Setup& setup);

/// The command that shows the heap of that name ("heap", "surface_heap", "joint_heap").
std::string view_command(const std::string& name, std::uint64_t seed, const Setup& setup);

}  // namespace fathom::validate
