// Builds meshes: checks the input, joins equal vertices, and sorts triangles into a tree of boxes.
#pragma once

#include <fathom/mesh.hpp>

namespace fathom {

class MeshBuilder {
 public:
  static std::shared_ptr<const TriangleMesh> build(std::span<const Vec3> vertices,
                                                   std::span<const std::uint32_t> indices);

 private:
  explicit MeshBuilder(TriangleMesh& mesh) : mesh_(mesh) {}
  void join_vertices(std::span<const Vec3> vertices, std::span<const std::uint32_t> indices);
  void make_tree();

  TriangleMesh& mesh_;
  std::vector<std::uint32_t> given_;  // vertices of the triangles with an area, three each
};

}  // namespace fathom
