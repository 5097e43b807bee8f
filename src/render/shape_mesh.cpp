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

/// Each triangle as four, with new corners on the sphere.
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

float distance_to_line(Vec3 point, Vec3 a, Vec3 b) { return length(cross(point - a, normalize(b - a))); }

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
  // From the lower pole up; the equator comes twice, once for each end.
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
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vec3 a = corners[i], b = corners[(i + 1) % corners.size()];
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      // Within this triangle the distance from the edge a, b grows linearly towards the middle.
      mesh.vertices.push_back({a, n, 0});
      mesh.vertices.push_back({b, n, 0});
      mesh.vertices.push_back({middle, n, distance_to_line(middle, a, b)});
      add_triangle(mesh, first, first + 1, first + 2);
    }
  }
  return mesh;
}

}  // namespace fathom::render
