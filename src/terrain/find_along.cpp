#include "terrain/triangles_along.hpp"

namespace fathom {

void TriangleMesh::find_along(Vec3 centre, Vec3 half, Vec3 translation, TriangleVisitor& visitor) const {
  triangles_along(
      nodes_.data(), BoxWay(centre, half, translation), [&](std::uint32_t number) { return triangle(number); },
      [&](std::uint32_t number, const Triangle&) { return visitor.visit(number); });
}

void HeightField::find_along(Vec3 centre, Vec3 half, Vec3 translation, TriangleVisitor& visitor) const {
  triangles_along(*this, centre, half, translation,
                  [&](std::uint32_t number, const Triangle&) { return visitor.visit(number); });
}

}  // namespace fathom
