#include "render/shape_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace fathom::render {
namespace {

Vec3 axis(int i) { return {i == 0 ? 1.0f : 0.0f, i == 1 ? 1.0f : 0.0f, i == 2 ? 1.0f : 0.0f}; }

void add_triangle(Mesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  mesh.indices.insert(mesh.indices.end(), {a, b, c});
}

Mesh icosahedron() {
  const float g = 0.5f * (1 + std::sqrt(5.0f));
  const Vec3 corners[] = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                          {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  Mesh mesh;
  for (const Vec3 corner : corners) mesh.vertices.push_back({normalize(corner), normalize(corner)});
  mesh.indices = {0, 11, 5, 0, 5, 1, 0, 1, 7, 0, 7, 10, 0, 10, 11, 1, 5, 9, 5, 11, 4,  11, 10, 2,  10, 7, 6, 7, 1, 8,
                  3, 9,  4, 3, 4, 2, 3, 2, 6, 3, 6, 8,  3, 8,  9,  4, 9, 5, 2, 4,  11, 6,  2,  10, 8,  6, 7, 9, 8, 1};
  return mesh;
}

/// Splits each triangle into four, with the new corners on the sphere.
Mesh split(const Mesh& coarse) {
  Mesh fine;
  fine.vertices = coarse.vertices;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [entry, is_new] =
        middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(fine.vertices.size()));
    if (is_new) {
      const Vec3 p = normalize(fine.vertices[a].position + fine.vertices[b].position);
      fine.vertices.push_back({p, p});
    }
    return entry->second;
  };
  for (std::size_t i = 0; i < coarse.indices.size(); i += 3) {
    const std::uint32_t a = coarse.indices[i], b = coarse.indices[i + 1], c = coarse.indices[i + 2];
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    add_triangle(fine, a, ab, ca);
    add_triangle(fine, b, bc, ab);
    add_triangle(fine, c, ca, bc);
    add_triangle(fine, ab, bc, ca);
  }
  return fine;
}

constexpr float no_edge = 1e6f;  // for meshes so fine that edge lines would hide the picture

float distance_to_line(Vec3 point, Vec3 a, Vec3 b) { return length(cross(point - a, normalize(b - a))); }

/// A part of a rounded hull: the patch of a ball about `centres[0]` or a strip of a cylinder, from one great arc of
/// normals to another, each given by its ends.
void add_round_patch(Mesh& mesh, const Vec3 (&centres)[2], const Vec3 (&from)[2], const Vec3 (&to)[2], float radius) {
  constexpr int pieces = 4;
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  const auto between = [](const Vec3(&ends)[2], float t) { return normalize((1 - t) * ends[0] + t * ends[1]); };
  for (int i = 0; i <= pieces; ++i)
    for (int k = 0; k < 2; ++k) {
      const Vec3 n = between(k == 0 ? from : to, static_cast<float>(i) / pieces);
      mesh.vertices.push_back({mul_add(centres[k], radius, n), n, no_edge});
    }
  for (std::uint32_t i = 0; i < pieces; ++i) {
    const std::uint32_t a = first + 2 * i;
    add_triangle(mesh, a, a + 1, a + 3);
    add_triangle(mesh, a, a + 3, a + 2);
  }
}

/// Edges and corners of a rounded hull.
void add_round_edges(Mesh& mesh, const Hull& hull) {
  const auto edges = hull.edges();
  const auto normal = [&](std::size_t e) { return hull.planes()[edges[e].face].normal; };
  std::vector<Vec3> middles(hull.vertices().size());  // of the normals at each vertex
  for (std::size_t e = 0; e < edges.size(); ++e) middles[edges[e].origin] += normal(e);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const Vec3 at = hull.vertices()[edges[e].origin], end = hull.vertices()[edges[e ^ 1].origin];
    const Vec3 left = normal(e), right = normal(e ^ 1);
    if (e % 2 == 0) add_round_patch(mesh, {at, end}, {right, left}, {right, left}, hull.radius());
    // The corner's normals, in rings from the middle to the side between this edge's faces.
    const Vec3 middle = normalize(middles[edges[e].origin]);
    constexpr int rings = 3;
    for (int ring = 0; ring < rings; ++ring) {
      const auto out = [&](Vec3 n, int r) { return middle + (static_cast<float>(r) / rings) * (n - middle); };
      add_round_patch(mesh, {at, at}, {out(right, ring), out(left, ring)}, {out(right, ring + 1), out(left, ring + 1)},
                      hull.radius());
    }
  }
}

}  // namespace

Mesh unit_box() {
  Mesh mesh;
  for (int face = 0; face < 6; ++face) {
    const float sign = face < 3 ? 1.0f : -1.0f;
    const Vec3 n = sign * axis(face % 3), u = axis((face + 1) % 3), v = sign * axis((face + 2) % 3);
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const Vec3 corner : {n - u - v, n + u - v, n + u + v, n - u + v}) mesh.vertices.push_back({corner, n});
    add_triangle(mesh, first, first + 1, first + 2);
    add_triangle(mesh, first, first + 2, first + 3);
  }
  return mesh;
}

Mesh unit_sphere(int splits) {
  Mesh mesh = icosahedron();
  for (int i = 0; i < splits; ++i) mesh = split(mesh);
  return mesh;
}

Mesh unit_capsule(int segments) {
  Mesh mesh;
  const int rings = segments / 4;
  // From the lower pole up; the equator occurs twice, once for each end.
  for (int half = 0; half < 2; ++half) {
    for (int ring = 0; ring <= rings; ++ring) {
      const float latitude = 0.5f * pi * (static_cast<float>(ring) / static_cast<float>(rings) - (half == 0 ? 1 : 0));
      for (int i = 0; i <= segments; ++i) {
        const float longitude = 2 * pi * static_cast<float>(i) / static_cast<float>(segments);
        const Vec3 p{std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude),
                     std::sin(latitude)};
        mesh.vertices.push_back({p, p, half == 0 ? -1.0f : 1.0f});
      }
    }
  }
  const auto row = static_cast<std::uint32_t>(segments + 1);
  for (std::uint32_t r = 0; r + 1 < 2 * static_cast<std::uint32_t>(rings + 1); ++r) {
    for (std::uint32_t i = 0; i + 1 < row; ++i) {
      const std::uint32_t a = r * row + i, b = a + 1, c = b + row, d = a + row;
      add_triangle(mesh, a, b, c);
      add_triangle(mesh, a, c, d);
    }
  }
  return mesh;
}

Mesh hull_mesh(const Hull& hull) {
  Mesh mesh;
  const auto edges = hull.edges();
  for (std::size_t face = 0; face < hull.face_edges().size(); ++face) {
    std::vector<Vec3> corners;
    std::uint16_t edge = hull.face_edges()[face];
    do {
      corners.push_back(hull.vertices()[edges[edge].origin]);
      edge = edges[edge].next;
    } while (edge != hull.face_edges()[face]);
    Vec3 middle;
    for (const Vec3 corner : corners) middle += (1.0f / static_cast<float>(corners.size())) * corner;
    const Vec3 n = hull.planes()[face].normal;
    for (Vec3& corner : corners) corner = mul_add(corner, hull.radius(), n);
    middle = mul_add(middle, hull.radius(), n);
    const bool is_rounded = hull.radius() > 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vec3 a = corners[i], b = corners[(i + 1) % corners.size()];
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      // Within this triangle the distance from the edge a, b grows linearly towards the centre.
      mesh.vertices.push_back({a, n, is_rounded ? no_edge : 0});
      mesh.vertices.push_back({b, n, is_rounded ? no_edge : 0});
      mesh.vertices.push_back({middle, n, is_rounded ? no_edge : distance_to_line(middle, a, b)});
      add_triangle(mesh, first, first + 1, first + 2);
    }
  }
  if (hull.radius() > 0) add_round_edges(mesh, hull);
  return mesh;
}

namespace {

/// A child about its own centre.
Mesh child_mesh(const Shape& shape) {
  const Vec3 h = shape.half_extents;
  if (shape.hull) return hull_mesh(*shape.hull);
  if (shape.type == ShapeType::box) {
    std::vector<Vec3> corners;
    for (int i = 0; i < 8; ++i) corners.push_back({i & 1 ? h.x : -h.x, i & 2 ? h.y : -h.y, i & 4 ? h.z : -h.z});
    return hull_mesh(*hull(corners).hull);
  }
  Mesh mesh = shape.type == ShapeType::sphere ? unit_sphere(3) : unit_capsule(24);
  for (MeshVertex& v : mesh.vertices) {
    v.position = shape.radius * v.position + Vec3{0, 0, v.extra * h.z};
    v.extra = no_edge;
  }
  return mesh;
}

}  // namespace

Mesh compound_mesh(const Compound& compound) {
  Mesh mesh;
  for (const ChildShape& child : compound.children()) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    const Mesh part = child_mesh(child.shape);
    for (const MeshVertex& v : part.vertices)
      mesh.vertices.push_back({transform(child.pose, v.position), rotate(child.pose.rotation, v.normal), v.extra});
    for (const std::uint32_t index : part.indices) mesh.indices.push_back(first + index);
  }
  return mesh;
}

Mesh surface_mesh(const fathom::Surface& surface) {
  Mesh mesh;
  for (std::uint32_t i = 0; i < surface.triangle_count(); ++i) {
    if (!surface.has(i)) continue;
    const auto [a, b, c] = surface.triangle(i).corners;
    const Vec3 n = normalize(cross(b - a, c - a), {0, 0, 1});
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const Vec3 corner : {a, b, c}) mesh.vertices.push_back({corner, n, no_edge});
    add_triangle(mesh, first, first + 1, first + 2);
  }
  // If there are only holes, uses a point, because empty meshes cannot be drawn.
  if (mesh.vertices.empty()) mesh = {{MeshVertex{}}, {0, 0, 0}};
  return mesh;
}

}  // namespace fathom::render
