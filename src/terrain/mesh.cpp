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
  const OverlapTest test(box);
  std::size_t count = found.size();
  search_box_tree(nodes_, test, [&](std::uint32_t t) {
    // Every triangle is written, and some are overwritten by the next: which of them stay is unpredictable.
    if (count == found.size()) found.resize(2 * count + 32);
    const std::uint32_t* const corners = &indices_[3 * std::size_t{t}];
    found[count] = t;
    count += test.overlaps(vertices_[corners[0]], vertices_[corners[1]], vertices_[corners[2]]) ? 1 : 0;
  });
  found.resize(count);
}

std::size_t TriangleMesh::memory_bytes() const {
  return vertices_.capacity() * sizeof(Vec3) + indices_.capacity() * sizeof(std::uint32_t) +
         nodes_.capacity() * sizeof(Node) + materials().size_bytes() + material_numbers().size_bytes();
}

}  // namespace fathom
