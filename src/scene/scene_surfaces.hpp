// The shapes of a scene file that come from files: triangle meshes, height fields, and saved shapes of any type.
#pragma once

#include <fathom/body.hpp>
#include <functional>
#include <string>
#include <vector>

#include "scene/toml_reader.hpp"

namespace fathom {

struct NamedMaterial {
  std::string name;  ///< empty for one without a name
  Material material;
};
/// Reads the list `materials` of a shape's table; empty if it has none.
using ReadMaterials = std::function<std::vector<NamedMaterial>(const TomlTable& shape)>;

/// All read a shape's table, `name` in error messages. Paths in it are relative to the scene file.
Shape read_mesh(const TomlTable& outer, const toml::table& shape, const std::string& name,
                const ReadMaterials& read_materials);
Shape read_saved_shape(const TomlTable& outer, const toml::table& shape, const std::string& name);
Shape read_height_field(const TomlTable& outer, const toml::table& shape, const std::string& name,
                        const ReadMaterials& read_materials);

}  // namespace fathom
