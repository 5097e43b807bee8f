#include <fathom/error.hpp>
#include <fathom/mesh.hpp>
#include <string>

#include "terrain/height_field_builder.hpp"
#include "terrain/mesh_builder.hpp"
#include "world/validate.hpp"

namespace fathom {
namespace {

/// `part`: what has a number, a triangle or a cell, of which there are `count`.
void check_materials(const SurfaceMaterials& materials, const std::string& function, std::size_t count,
                     const std::string& part) {
  constexpr std::size_t most = 256;
  const auto say = [&](const std::string& what) { refuse(function + ": " + what); };
  if (materials.list.empty() && materials.numbers.empty()) return;
  if (materials.list.empty()) say("there are material numbers, but the list of materials is empty");
  if (materials.list.size() > most)
    say("there are " + std::to_string(materials.list.size()) + " materials; at most 256 are possible");
  for (std::size_t i = 0; i < materials.list.size(); ++i)
    check_material(materials.list[i], (function + ": material " + std::to_string(i)).c_str());
  if (materials.numbers.size() != count)
    say("there are " + std::to_string(materials.numbers.size()) + " material numbers for " + std::to_string(count) +
        " " + part + "s; give one for each");
  for (std::size_t i = 0; i < count; ++i)
    if (materials.numbers[i] >= materials.list.size())
      say("the material number of " + part + " " + std::to_string(i) + " is " + std::to_string(materials.numbers[i]) +
          ", but there are " + std::to_string(materials.list.size()) + " materials");
}

}  // namespace

Shape mesh(std::span<const Vec3> vertices, std::span<const std::uint32_t> indices, const SurfaceMaterials& materials) {
  check_materials(materials, "fathom::mesh", indices.size() / 3, "triangle");
  Shape shape;
  shape.type = ShapeType::mesh;
  shape.surface = MeshBuilder::build(vertices, indices, materials);
  return shape;
}

Shape height_field(const HeightFieldDef& def) {
  const std::size_t cells =
      def.columns < 2 || def.rows < 2 ? 0 : std::size_t{def.columns - 1} * std::size_t{def.rows - 1};
  check_materials(def.materials, "fathom::height_field", cells, "cell");
  Shape shape;
  shape.type = ShapeType::height_field;
  shape.surface = HeightFieldBuilder::build(def);
  return shape;
}

}  // namespace fathom
