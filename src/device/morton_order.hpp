// Neighbours in space as neighbours in memory.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>
#include <vector>

namespace fathom::device {

/// Indices of the places in the order of their Morton codes (10 bits an axis over the places' bounds); of equal codes
/// the lower index first.
std::vector<std::uint32_t> morton_order(const std::vector<Vec3>& places);

}  // namespace fathom::device
