// Scene files: TOML, described in docs/scenes.md.
#pragma once

#include <string>
#include <string_view>

#include "scene/scene.hpp"

namespace fathom {

/// Reads a scene file. Throws one `Error{file}` that names the fault's position and a remedy.
Scene load_scene(const std::string& path);
/// The same from text; `file` is its name in error messages.
Scene parse_scene(std::string_view text, std::string_view file);

}  // namespace fathom
