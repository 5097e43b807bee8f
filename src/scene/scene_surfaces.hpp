// The surfaces of a scene file: triangle meshes and height fields.
#pragma once

#include <fathom/shape.hpp>
#include <string>

#include "scene/toml_reader.hpp"

namespace fathom {

/// Both read a shape's table, `name` in error messages. Paths in it are relative to the scene file.
Shape read_mesh(const TomlTable& outer, const toml::table& shape, const std::string& name);
Shape read_height_field(const TomlTable& outer, const toml::table& shape, const std::string& name);

}  // namespace fathom
