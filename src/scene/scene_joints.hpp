// The [[joint]] tables of scene files.
#pragma once

#include "scene/scene.hpp"
#include "scene/toml_reader.hpp"

namespace fathom {

/// Adds the file's joints to the scene, whose bodies have been read.
void read_joints(const TomlTable& root, Scene& scene);

}  // namespace fathom
