// Triangles from glTF 2.0 files, as text (.gltf) or binary (.glb), with the Debian library TinyGLTF.
#pragma once

#include <string>

#include "scene/file_triangles.hpp"

namespace fathom {

/// The triangles of the file's default scene, or of all its scenes, with the transforms of their nodes. glTF has y up:
/// its (x, y, z) is (x, −z, y) here. Buffers in other files are looked for from the folder of `path`. Throws
/// `Error{file}` with the file's name and a remedy if it is malformed, if positions are sparse, compressed or not
/// floats, or if there is no triangle.
FileTriangles parse_gltf(const std::string& content, const std::string& path);

}  // namespace fathom
