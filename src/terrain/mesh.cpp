#include <fathom/mesh.hpp>

#include "geometry/box_tree.hpp"

namespace fathom {

Triangle TriangleMesh::triangle(std::uint32_t triangle) const {
  Triangle t;
  for (std::size_t k = 0; k < 3; ++k) {
    t.vertices[k] = indices_[3 * static_cast<std::size_t>(triangle) + k];
    t.corners[k] = vertices_[t.vertices[k]];
  }
  return t;
}

void TriangleMesh::find(const Aabb& box, std::vector<std::uint32_t>& found) const {
  search_box_tree(nodes_, box, [&](std::uint32_t t) {
    const Vec3 a = vertices_[indices_[3 * std::size_t{t}]], b = vertices_[indices_[3 * std::size_t{t} + 1]],
               c = vertices_[indices_[3 * std::size_t{t} + 2]];
    if (overlaps({min(a, min(b, c)), max(a, max(b, c))}, box)) found.push_back(t);
  });
}

std::size_t TriangleMesh::memory_bytes() const {
  return vertices_.capacity() * sizeof(Vec3) + indices_.capacity() * sizeof(std::uint32_t) +
         nodes_.capacity() * sizeof(Node);
}

}  // namespace fathom
