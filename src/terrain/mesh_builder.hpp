// Builds meshes: checks the input, joins equal vertices, and sorts triangles into a tree of boxes.
#pragma once

#include <fathom/mesh.hpp>

namespace fathom {

class MeshBuilder {
 public:
  /// The materials are valid.
  static std::shared_ptr<const TriangleMesh> build(std::span<const Vec3> vertices,
                                                   std::span<const std::uint32_t> indices,
                                                   const SurfaceMaterials& materials);

 private:
  explicit MeshBuilder(TriangleMesh& mesh) : mesh_(mesh) {}
  void join_vertices(std::span<const Vec3> vertices, std::span<const std::uint32_t> indices,
                     std::span<const std::uint8_t> numbers);
  void make_tree();
  void sort_vertices();

  TriangleMesh& mesh_;
  // Of the triangles with an area: vertices, three each, and materials, if there are any.
  std::vector<std::uint32_t> given_;
  std::vector<std::uint8_t> numbers_;
};

}  // namespace fathom
