// The surfaces of a scene file: triangle meshes and height fields.
#pragma once

#include <fathom/shape.hpp>
#include <string>

#include "scene/toml_reader.hpp"

namespace fathom {

/// Both read a shape's table, which `name` calls in complaints. Files that it names are beside the scene file, or where
/// their path leads from there.
Shape read_mesh(const TomlTable& outer, const toml::table& shape, const std::string& name);
Shape read_height_field(const TomlTable& outer, const toml::table& shape, const std::string& name);

}  // namespace fathom
