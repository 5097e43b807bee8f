// In which order bodies that are added together get their indices.
//
// Simulators keep bodies by index, and threads share them out by index. Where neighbours in space have neighbouring
// indices, what a thread works on lies together in memory, and little of it in other cores' caches.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>
#include <span>
#include <vector>

namespace fathom {

/// Indices of `defs`, whose positions are finite, in the order in which to add them: as they are, or, where that goes
/// to and fro in space, along a Morton curve. Rows and layers keep their order, whose contacts need fewer colours.
std::vector<std::uint32_t> placement_order(std::span<const BodyDef> defs);

}  // namespace fathom
