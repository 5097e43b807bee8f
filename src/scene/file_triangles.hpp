// Triangles as mesh files hold them.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>
#include <string>
#include <vector>

namespace fathom {

struct FileTriangles {
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> indices;      ///< three per triangle
  std::vector<std::string> materials;      ///< names; an empty one is of triangles without a material
  std::vector<std::uint32_t> material_of;  ///< which of them each triangle has

  /// Number of the material with this name, which is new if it is not there yet.
  std::uint32_t material_number(const std::string& name) {
    for (std::size_t i = 0; i < materials.size(); ++i)
      if (materials[i] == name) return static_cast<std::uint32_t>(i);
    materials.push_back(name);
    return static_cast<std::uint32_t>(materials.size() - 1);
  }
};

}  // namespace fathom
