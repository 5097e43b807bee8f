// Scene files: TOML, described in docs/scenes.md.
#pragma once

#include <string>
#include <string_view>

#include "scene/scene.hpp"

namespace fathom {

/// Reads a scene file. Throws one `Error{file}` that says where the fault is and what to do.
Scene load_scene(const std::string& path);
/// The same from text; `file` is what complaints call it.
Scene parse_scene(std::string_view text, std::string_view file);

}  // namespace fathom
