#include "geometry/hull_builder.hpp"

#include <algorithm>
#include <fathom/error.hpp>
#include <string>

#include "geometry/polygon_mesh.hpp"
#include "geometry/rounded_solid.hpp"

namespace fathom {
namespace {

constexpr std::size_t max_vertices = 255, max_faces = 255, max_half_edges = 1024;

/// Numbers the mesh without the gaps left by merging. Twins get consecutive numbers.
struct Numbering {
  std::vector<int> vertices, edges, faces;  // old index of each new one
  std::vector<int> new_vertex, new_edge;

  explicit Numbering(const PolygonMesh& mesh) : new_vertex(mesh.vertices.size(), -1), new_edge(mesh.edges.size(), -1) {
    for (int f = 0; f < static_cast<int>(mesh.faces.size()); ++f) {
      if (mesh.faces[f].edge >= 0) faces.push_back(f);
    }
    for (int e = 0; e < static_cast<int>(mesh.edges.size()); ++e) {
      const PolygonMesh::HalfEdge& edge = mesh.edges[e];
      if (edge.face < 0) continue;
      new_vertex[edge.origin] = 0;
      if (e > edge.twin) continue;
      for (const int half : {e, edge.twin}) {
        new_edge[half] = static_cast<int>(edges.size());
        edges.push_back(half);
      }
    }
    for (int v = 0; v < static_cast<int>(mesh.vertices.size()); ++v) {
      if (new_vertex[v] < 0) continue;
      new_vertex[v] = static_cast<int>(vertices.size());
      vertices.push_back(v);
    }
  }
};

void check_capacity(const Numbering& n) {
  if (n.vertices.size() <= max_vertices && n.faces.size() <= max_faces && n.edges.size() <= max_half_edges) return;
  throw Error(
      ErrorCode::degenerate_shape,
      "fathom::hull: the hull has " + std::to_string(n.vertices.size()) + " vertices, " +
          std::to_string(n.faces.size()) + " faces and " + std::to_string(n.edges.size()) +
          " half-edges; at most 255, 255 and 1024 fit. Simplify the mesh or split it into several convex parts");
}

/// Euler's formula: a polyhedron without holes has V − E + F = 2.
void check_euler(const Numbering& n) {
  if (n.vertices.size() + n.faces.size() == n.edges.size() / 2 + 2 && n.faces.size() >= 4) return;
  throw Error(ErrorCode::degenerate_shape,
              "fathom::hull: merging coplanar faces left no polyhedron; the points are too thin for their precision, "
              "give them thickness or use a box");
}

}  // namespace

Hull HullBuilder::build(std::span<const Vec3> points, float radius) {
  const TriangleHull triangles = triangle_hull(points);
  const PolygonMesh mesh = merge_coplanar(triangles);
  const Numbering numbering(mesh);
  check_capacity(numbering);
  check_euler(numbering);
  const SolidIntegrals solid = rounded_solid(mesh, to_double(radius));

  Hull hull;
  hull.radius_ = radius;
  const Vec3d centre = solid.centre();
  hull.offset_ = to_float(triangles.centre + centre);
  hull.volume_ = static_cast<float>(solid.volume());
  hull.unit_inertia_ = solid.unit_inertia();
  for (const int v : numbering.vertices) {
    hull.vertices_.push_back(to_float(mesh.vertices[v] - centre));
    hull.outer_radius_ = std::max(hull.outer_radius_, length(hull.vertices_.back()) + radius);
  }
  for (std::size_t f = 0; f < numbering.faces.size(); ++f) {
    const PolygonMesh::Face& face = mesh.faces[numbering.faces[f]];
    const float offset = static_cast<float>(face.offset - dot(face.normal, centre));
    hull.planes_.push_back({to_float(face.normal), offset});
    hull.inner_radius_ = f == 0 ? offset + radius : std::min(hull.inner_radius_, offset + radius);
    hull.face_edges_.push_back(static_cast<std::uint16_t>(numbering.new_edge[face.edge]));
  }
  for (const int e : numbering.edges) {
    const PolygonMesh::HalfEdge& edge = mesh.edges[e];
    const auto face = std::lower_bound(numbering.faces.begin(), numbering.faces.end(), edge.face);
    hull.edges_.push_back({static_cast<std::uint16_t>(numbering.new_edge[edge.next]),
                           static_cast<std::uint8_t>(numbering.new_vertex[edge.origin]),
                           static_cast<std::uint8_t>(face - numbering.faces.begin())});
  }
  hull.arrange();
  return hull;
}

}  // namespace fathom
