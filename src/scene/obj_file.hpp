// Triangles from Wavefront OBJ files: the lines 'v' and 'f'. Everything else in them is left out.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace fathom {

struct ObjTriangles {
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> indices;  ///< three per triangle; polygons are fans about their first corner
};

/// Throws `Error{file}` with the line of `file` and what to do where a number is none or not finite, a polygon has
/// fewer than three corners or a corner that names no vertex above it, and where there is no polygon at all.
ObjTriangles parse_obj(std::string_view text, const std::string& file);

}  // namespace fathom
