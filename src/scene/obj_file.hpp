// Triangles from Wavefront OBJ files: the lines 'v', 'f' and 'usemtl'. Everything else is ignored.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace fathom {

struct ObjTriangles {
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> indices;  ///< three per triangle; polygons become fans about their first corner
  std::vector<std::string> materials;  ///< names after 'usemtl'; the first is empty, for triangles above all of them
  std::vector<std::uint32_t> material_of;  ///< which of them each triangle has
};

/// Throws `Error{file}` with the line of `file` and a remedy if a number is malformed or not finite, a polygon has
/// fewer than three corners or a corner that names no vertex above it, or there is no polygon at all.
ObjTriangles parse_obj(std::string_view text, const std::string& file);

}  // namespace fathom
