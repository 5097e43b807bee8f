// The bodies of a scene file, with the materials and shapes they refer to.
#pragma once

#include "scene/scene.hpp"
#include "scene/toml_reader.hpp"

namespace fathom {

/// Reads [materials], [shapes] and [[body]] of the file's root table into the scene.
void read_bodies(const TomlTable& root, Scene& scene);

}  // namespace fathom
