// Triangles of collision shapes.
#pragma once

#include <cstdint>
#include <fathom/compound.hpp>
#include <fathom/mesh.hpp>
#include <vector>

namespace fathom::render {

struct MeshVertex {
  Vec3 position;
  Vec3 normal;
  /// Hull: distance (m) from the nearest edge of its face; a huge value where lines are not drawn. Capsule: −1 or 1,
  /// the end it belongs to. Otherwise 0.
  float extra = 0;
};

/// Triangles run counter-clockwise seen from outside.
struct Mesh {
  std::vector<MeshVertex> vertices;
  std::vector<std::uint32_t> indices;
};

/// The box from −1 to 1 on each axis.
Mesh unit_box();
/// Sphere of radius 1: an icosahedron whose triangles are split into four `splits` times.
Mesh unit_sphere(int splits);
/// Sphere of radius 1 cut at its equator; its halves are moved apart along z by half the capsule's length.
Mesh unit_capsule(int segments);
/// The hull's faces as fans around their centres, in metres; of a rounded hull also its edges and corners.
Mesh hull_mesh(const Hull& hull);
/// All children, in metres.
Mesh compound_mesh(const Compound& compound);
/// The surface's triangles, flat-shaded and visible only from outside, as bodies collide with them.
Mesh surface_mesh(const fathom::Surface& surface);

}  // namespace fathom::render
