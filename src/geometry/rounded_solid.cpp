#include "geometry/rounded_solid.hpp"

#include <cmath>

namespace fathom {
namespace {

Vec3d unit(Vec3d v) { return (1 / length(v)) * v; }

double angle_between(Vec3d a, Vec3d b) { return std::atan2(length(cross(a, b)), dot(a, b)); }

/// Visits a mesh that has faces and edges merged away.
class Visitor {
 public:
  explicit Visitor(const PolygonMesh& mesh) : mesh_(mesh) {}

  Vec3d origin(int e) const { return mesh_.vertices[mesh_.edges[e].origin]; }
  Vec3d end(int e) const { return origin(mesh_.edges[e].next); }
  Vec3d along(int e) const { return end(e) - origin(e); }
  Vec3d normal(int e) const { return mesh_.faces[mesh_.edges[e].face].normal; }
  int twin(int e) const { return mesh_.edges[e].twin; }
  int previous(int e) const { return mesh_.edges[e].previous; }

 private:
  const PolygonMesh& mesh_;
};

void add_faces(const PolygonMesh& mesh, double radius, SolidIntegrals& solid) {
  const Visitor visit(mesh);
  for (const PolygonMesh::Face& face : mesh.faces) {
    if (face.edge < 0) continue;
    const Vec3d up = radius * face.normal;
    for (int e = mesh.edges[face.edge].next; mesh.edges[e].next != face.edge; e = mesh.edges[e].next) {
      const Vec3d a = visit.origin(face.edge), b = visit.origin(e), c = visit.end(e);
      solid.add(a, b, c);
      if (radius > 0) solid.add_prism(a, b, c, up);
    }
  }
}

/// The edge of half-edge e: a sector of a cylinder between the normals of its faces.
void add_edge(const Visitor& visit, int e, double radius, SolidIntegrals& solid) {
  const Vec3d from = visit.origin(e), along = visit.along(e);
  const Vec3d left = visit.normal(e), right = visit.normal(visit.twin(e));
  const double angle = angle_between(left, right), l = length(along), r2 = radius * radius;
  const Vec3d middle = unit(left + right), across = unit(cross(along, middle));
  // Integrals over the angle of the unit vector u between the normals: of 1, u and u·uᵀ.
  const Vec3d first = 2 * std::sin(angle / 2) * middle;
  const double of_middle = (angle + std::sin(angle)) / 2, of_across = (angle - std::sin(angle)) / 2;
  const double area = angle * r2 / 2;
  const Vec3d ray = (radius * r2 / 3) * first, centre = from + 0.5 * along;
  Moments m{l * area, l * area * centre + l * ray, {}};
  m.second.add(l * area, centre, centre);
  m.second.add(l * area / 12, along, along);
  m.second.add(l, centre, ray);
  m.second.add(l, ray, centre);
  m.second.add(l * r2 * r2 / 4 * of_middle, middle, middle);
  m.second.add(l * r2 * r2 / 4 * of_across, across, across);
  solid.add(m);
}

/// The part at the origin of half-edge e of the sector of a ball there, which is the sum of such parts over all
/// half-edges that start at the vertex. A vertex's normals form a spherical polygon. Its area is 2π less the angles of
/// the faces there; integrals of u and u·uᵀ over it follow from its sides by Stokes's theorem (J. Arvo, Applications of
/// Irradiance Tensors to the Simulation of Non-Lambertian Phenomena, SIGGRAPH 1995, eq. 12). The side between the
/// normals of an edge's faces has that edge as outward normal.
struct VertexSector {
  double solid_angle = 2 * 3.14159265358979323846;
  Vec3d first;    ///< ∫ u
  Tensor3 sides;  ///< to be subtracted

  void add(const Visitor& visit, int e) {
    const Vec3d out = unit(visit.along(e)), left = visit.normal(e), right = visit.normal(visit.twin(e));
    const double angle = angle_between(left, right);
    solid_angle -= angle_between(visit.along(e), -visit.along(visit.previous(e)));
    first += (-angle / 2) * out;
    sides.add(std::tan(angle / 2), left + right, out);
  }
  Moments moments(Vec3d vertex, double radius) const {
    const double r3 = radius * radius * radius, volume = solid_angle * r3 / 3;
    const Vec3d ray = (r3 * radius / 4) * first;
    Moments m{volume, volume * vertex + ray, {}};
    m.second.add(volume, vertex, vertex);
    m.second.add(1, vertex, ray);
    m.second.add(1, ray, vertex);
    const double of_square = r3 * radius * radius / 15;
    for (const Vec3d axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}})
      m.second.add(of_square * solid_angle, axis, axis);
    m.second.add(-of_square, sides);
    return m;
  }
};

}  // namespace

SolidIntegrals rounded_solid(const PolygonMesh& mesh, double radius) {
  SolidIntegrals solid;
  add_faces(mesh, radius, solid);
  if (radius == 0) return solid;
  const Visitor visit(mesh);
  std::vector<VertexSector> sectors(mesh.vertices.size());
  std::vector<bool> is_vertex(mesh.vertices.size(), false);
  for (int e = 0; e < static_cast<int>(mesh.edges.size()); ++e) {
    if (mesh.edges[e].face < 0) continue;
    if (e < visit.twin(e)) add_edge(visit, e, radius, solid);
    sectors[mesh.edges[e].origin].add(visit, e);
    is_vertex[mesh.edges[e].origin] = true;
  }
  for (std::size_t v = 0; v < sectors.size(); ++v)
    if (is_vertex[v]) solid.add(sectors[v].moments(mesh.vertices[v], radius));
  return solid;
}

}  // namespace fathom
