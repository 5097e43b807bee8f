// Orders positions so that neighbours in space are neighbours in memory.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>
#include <vector>

namespace fathom {

/// Indices of the positions (finite) in the order of their Morton codes: 10 bits per axis over the positions' bounds
/// (Morton, "A computer oriented geodetic data base", IBM 1966). Ties keep the order of indices.
std::vector<std::uint32_t> morton_order(const std::vector<Vec3>& positions);

}  // namespace fathom
