// Shapes as bytes, so that a large mesh is built once and not at every start ("cooked" in other engines).
#pragma once

#include <cstddef>
#include <fathom/export.hpp>
#include <fathom/shape.hpp>
#include <span>
#include <vector>

namespace fathom {

/// Writes a shape of any type, with its materials, over `out`. Throws `Error{invalid_argument}` for a shape that no
/// body could have.
FATHOM_API void save_shape(const Shape& shape, std::vector<std::byte>& out);

/// The shape that `save_shape` wrote. Its arrays are copied and checked, but not built again. The result is the same to
/// the bit: bodies move on it as on the original. Throws `Error{file}` if the bytes are no shape, truncated, altered or
/// of another format version.
FATHOM_API Shape load_shape(std::span<const std::byte> bytes);

}  // namespace fathom
