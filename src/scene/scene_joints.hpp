// The [[joint]] and [[exclude]] tables of scene files.
#pragma once

#include "scene/scene.hpp"
#include "scene/toml_reader.hpp"

namespace fathom {

// Both add to the scene, whose bodies must have been read.

void read_joints(const TomlTable& root, Scene& scene);
/// Reads pairs that do not collide, [[exclude]].
void read_excluded(const TomlTable& root, Scene& scene);

}  // namespace fathom
