// Coplanar merging on half-edges (Gregorius: Implementing Quickhull, GDC 2014, with the merging done afterwards).
//
// Every merge is checked first. A refused merge leaves two faces that are coplanar up to rounding, which is harmless. A
// wrong merge would leave a mesh that is not a polyhedron.
#include "geometry/polygon_mesh.hpp"

#include <algorithm>
#include <cmath>

namespace fathom {
namespace {

constexpr double plane_tolerance = 8;  // × noise; a triangle's own corners may be off by four

class Merger {
 public:
  explicit Merger(const TriangleHull& hull) : tolerance_(plane_tolerance * hull.noise) {
    mesh_.vertices = hull.vertices;
    for (int f = 0; f < static_cast<int>(hull.triangles.size()); ++f) {
      const TriangleHull::Triangle& t = hull.triangles[f];
      for (int i = 0; i < 3; ++i) {
        const TriangleHull::Triangle& across = hull.triangles[t.neighbour[i]];
        const auto& v = across.vertex;
        const auto back = std::find(v.begin(), v.end(), t.vertex[(i + 1) % 3]) - v.begin();
        const int twin = 3 * t.neighbour[i] + static_cast<int>(back);
        mesh_.edges.push_back({3 * f + (i + 1) % 3, 3 * f + (i + 2) % 3, twin, t.vertex[i], f});
      }
      mesh_.faces.push_back({3 * f, 3, {}, 0});
      fit_plane(mesh_.faces.back());
    }
    used_.assign(mesh_.vertices.size(), true);
  }

  PolygonMesh run() {
    // Flattest first, so that faces grow from triangles that are certainly coplanar.
    std::vector<std::pair<double, int>> order;
    for (int e = 0; e < static_cast<int>(mesh_.edges.size()); ++e) {
      if (e < mesh_.edges[e].twin) order.emplace_back(bend(e), e);
    }
    std::sort(order.begin(), order.end());
    for (bool changed = true; changed;) {
      changed = false;
      for (const auto& [bend, e] : order) {
        if (mesh_.edges[e].face >= 0 && may_merge(e)) merge(e), changed = true;
      }
    }
    return std::move(mesh_);
  }

 private:
  using HalfEdge = PolygonMesh::HalfEdge;
  using Face = PolygonMesh::Face;

  const HalfEdge& edge(int e) const { return mesh_.edges[e]; }
  Vec3d origin(int e) const { return mesh_.vertices[edge(e).origin]; }

  std::vector<int> loop(int first) const {
    std::vector<int> edges{first};
    for (int e = edge(first).next; e != first; e = edge(e).next) edges.push_back(e);
    return edges;
  }

  /// Distance of the corners of an edge's two triangles from each other's plane.
  double bend(int e) const {
    const int t = edge(e).twin;
    const Face &f = mesh_.faces[edge(e).face], &g = mesh_.faces[edge(t).face];
    const Vec3d tip = origin(edge(e).previous), other_tip = origin(edge(t).previous);
    return std::max(f.offset - dot(f.normal, other_tip), g.offset - dot(g.normal, tip));
  }

  struct Plane {
    Vec3d normal;
    double offset;
  };
  /// Newell's plane of a polygon: normal along its area vector, through the mean of its corners.
  static Plane plane_of(const std::vector<Vec3d>& corners) {
    Vec3d area, sum;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      area += cross(corners[i] - corners[0], corners[(i + 1) % corners.size()] - corners[0]);
      sum += corners[i] - corners[0];
    }
    const Vec3d normal = (1 / length(area)) * area;
    const Vec3d mean = corners[0] + (1 / static_cast<double>(corners.size())) * sum;
    return {normal, dot(normal, mean)};
  }

  void fit_plane(Face& face) const {
    std::vector<Vec3d> corners;
    for (const int e : loop(face.edge)) corners.push_back(origin(e));
    const Plane plane = plane_of(corners);
    face.normal = plane.normal;
    face.offset = plane.offset;
  }

  int degree(int e) const {
    int count = 1;
    for (int i = edge(edge(e).twin).next; i != e; i = edge(edge(i).twin).next) ++count;
    return count;
  }

  /// Whether edge e may be removed at the vertex where it starts: if three edges remain there, or if the two that
  /// remain form one straight edge and the third face can spare the vertex.
  bool may_lose(int e) const {
    if (degree(e) > 3) return true;
    const int in = edge(e).previous, out = edge(edge(e).twin).next;  // the two edges that remain: in → e.origin → out
    if (mesh_.faces[edge(edge(out).twin).face].edge_count < 4) return false;
    const Vec3d a = origin(in), b = origin(edge(out).next), p = origin(e);
    return length(cross(b - a, p - a)) <= tolerance_ * length(b - a);
  }

  bool may_merge(int e) const {
    const int t = edge(e).twin;
    const int f = edge(e).face, g = edge(t).face;
    std::vector<int> edges;
    for (const int i : loop(edge(e).next)) {
      if (i != e && edge(edge(i).twin).face == g) return false;  // they meet a second time
      if (i != e) edges.push_back(i);
    }
    for (const int i : loop(edge(t).next)) {
      if (i != t) edges.push_back(i);
    }
    std::vector<Vec3d> corners;
    for (const int i : edges) corners.push_back(origin(i));

    const Plane plane = plane_of(corners);
    if (!(dot(plane.normal, mesh_.faces[f].normal) > 0 || dot(plane.normal, mesh_.faces[g].normal) > 0)) return false;
    for (const Vec3d p : corners) {
      if (std::abs(dot(plane.normal, p) - plane.offset) > tolerance_) return false;
    }
    if (!is_convex(corners, plane.normal) || !may_lose(e) || !may_lose(t)) return false;
    for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
      if (used_[v] && dot(plane.normal, mesh_.vertices[v]) - plane.offset > tolerance_) return false;
    }
    return true;
  }

  /// Whether no corner lies inside the line through its neighbours by more than the tolerance.
  bool is_convex(const std::vector<Vec3d>& corners, Vec3d normal) const {
    const std::size_t n = corners.size();
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3d a = corners[i], p = corners[(i + 1) % n], b = corners[(i + 2) % n];
      if (dot(cross(p - a, b - a), normal) < -tolerance_ * length(b - a)) return false;
    }
    return true;
  }

  /// Removes edge `e`; its face absorbs the face on the other side.
  void merge(int e) {
    const int t = edge(e).twin;
    const bool straight_here = degree(e) == 3, straight_there = degree(t) == 3;
    const int f = edge(e).face, g = edge(t).face;
    const int here = edge(t).next, there = edge(e).next;  // leave from e's two ends in the merged face
    for (const int i : loop(t)) mesh_.edges[i].face = f;
    link(edge(e).previous, here);
    link(edge(t).previous, there);
    mesh_.edges[e].face = mesh_.edges[t].face = -1;
    mesh_.faces[f].edge = here;
    mesh_.faces[f].edge_count += mesh_.faces[g].edge_count - 2;
    mesh_.faces[g].edge = -1;
    if (straight_here) straighten(here);
    if (straight_there) straighten(there);
    fit_plane(mesh_.faces[f]);
  }

  void link(int e, int next) {
    mesh_.edges[e].next = next;
    mesh_.edges[next].previous = e;
  }

  /// Removes the vertex where `out` starts, which has only two edges: the edge before it continues along `out`.
  void straighten(int out) {
    const int in = edge(out).previous;
    const int out_twin = edge(out).twin, in_twin = edge(in).twin;
    used_[edge(out).origin] = false;
    mesh_.edges[in_twin].origin = edge(out_twin).origin;
    link(in, edge(out).next);
    link(edge(out_twin).previous, in_twin);
    for (const int kept : {in, in_twin}) {
      Face& face = mesh_.faces[edge(kept).face];
      face.edge = kept;
      --face.edge_count;
    }
    mesh_.edges[out].face = mesh_.edges[out_twin].face = -1;
    fit_plane(mesh_.faces[edge(in_twin).face]);
  }

  const double tolerance_;
  PolygonMesh mesh_;
  std::vector<bool> used_;
};

}  // namespace

PolygonMesh merge_coplanar(const TriangleHull& hull) { return Merger(hull).run(); }

}  // namespace fathom
