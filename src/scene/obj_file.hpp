// Triangles from Wavefront OBJ files: the lines 'v', 'f' and 'usemtl'. Everything else is ignored.
#pragma once

#include <string>
#include <string_view>

#include "scene/file_triangles.hpp"

namespace fathom {

/// Polygons become fans about their first corner, and triangles above every 'usemtl' have the material "". Throws
/// `Error{file}` with the line of `file` and a remedy if a number is malformed or not finite, a polygon has
/// fewer than three corners or a corner that names no vertex above it, or there is no polygon at all.
FileTriangles parse_obj(std::string_view text, const std::string& file);

}  // namespace fathom
