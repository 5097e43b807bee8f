// The order in which bodies added together get their indices.
//
// Simulators store bodies by index, and threads divide them by index. If neighbours in space have neighbouring indices,
// a thread's data is contiguous in memory, and little of it is in other cores' caches.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>
#include <span>
#include <vector>

namespace fathom {

/// Indices of `defs`, whose positions are finite, in the order in which to add them: as given or, if that is scattered
/// in space, along a Morton curve. Rows and layers keep their order, which needs fewer colours.
std::vector<std::uint32_t> placement_order(std::span<const BodyDef> defs);

}  // namespace fathom
