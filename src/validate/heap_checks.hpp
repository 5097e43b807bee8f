// What must hold in every random heap, whatever is in it.
#pragma once

#include <cstdint>

#include "scene/heap.hpp"
#include "validate/record.hpp"
#include "validate/setup.hpp"

namespace fathom::validate {

/// Simulates the heap of the seed and checks what can be asked of one of its kind. Names of checks are the same for all
/// seeds. A heap that loses a body is not simulated to its end. Checks that some heaps are known to fail say so
/// (docs/validation.md counts them).
Record judge_heap(std::uint64_t seed, const Setup& setup);

/// The command that shows it.
std::string view_command(std::uint64_t seed, const Setup& setup);

}  // namespace fathom::validate
