#include "terrain/mesh_builder.hpp"

#include <algorithm>
#include <cmath>
#include <fathom/error.hpp>
#include <numeric>
#include <string>
#include <tuple>

#include "geometry/box_tree.hpp"
#include "math/text.hpp"
#include "math/vec3d.hpp"

namespace fathom {
namespace {

[[noreturn]] void refuse(const std::string& what) { throw Error(ErrorCode::invalid_argument, "fathom::mesh: " + what); }

void check(std::span<const Vec3> vertices, std::span<const std::uint32_t> indices) {
  constexpr float farthest = 1e6f;  // m: single precision still resolves 6 cm there
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Vec3 v = vertices[i];
    if (is_finite(v) && max_component(abs(v)) <= farthest) continue;
    refuse("vertex " + std::to_string(i) + " is (" + text(to_double(v.x)) + ", " + text(to_double(v.y)) + ", " +
           text(to_double(v.z)) + "); coordinates must be finite and within 1e6 m of the origin");
  }
  if (indices.size() % 3 != 0)
    refuse("there are " + std::to_string(indices.size()) + " indices; give three per triangle");
  if (indices.size() / 3 > (1u << 30)) refuse("there are more than 2^30 triangles; divide them among several meshes");
  for (std::size_t i = 0; i < indices.size(); ++i)
    if (indices[i] >= vertices.size())
      refuse("index " + std::to_string(i) + ", of triangle " + std::to_string(i / 3) + ", is " +
             std::to_string(indices[i]) + ", but there are " + std::to_string(vertices.size()) + " vertices");
}

/// Whether the height exceeds a millionth of the longest side.
bool has_area(Vec3 a, Vec3 b, Vec3 c) {
  const Vec3d ab = to_double(b) - to_double(a), ac = to_double(c) - to_double(a), bc = ac - ab;
  const double longest = std::max({dot(ab, ab), dot(ac, ac), dot(bc, bc)}), twice_area = length(cross(ab, ac));
  return twice_area > 1e-6 * longest;
}

}  // namespace

std::shared_ptr<const TriangleMesh> MeshBuilder::build(std::span<const Vec3> vertices,
                                                       std::span<const std::uint32_t> indices,
                                                       const SurfaceMaterials& materials) {
  check(vertices, indices);
  auto mesh = std::make_shared<TriangleMesh>();
  MeshBuilder builder(*mesh);
  builder.join_vertices(vertices, indices, materials.numbers);
  mesh->materials_.assign(materials.list.begin(), materials.list.end());
  if (builder.given_.empty())
    throw Error(ErrorCode::degenerate_shape, indices.empty()
                                                 ? "fathom::mesh: there are no triangles"
                                                 : "fathom::mesh: none of its " + std::to_string(indices.size() / 3) +
                                                       " triangles has an area; lengths are in metres");
  builder.make_tree();
  return mesh;
}

// Merges vertices at equal positions; drops those used only by triangles without area.
void MeshBuilder::join_vertices(std::span<const Vec3> vertices, std::span<const std::uint32_t> indices,
                                std::span<const std::uint8_t> numbers) {
  std::vector<std::uint32_t> order(vertices.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto position = [&](std::uint32_t i) { return std::tuple(vertices[i].x, vertices[i].y, vertices[i].z); };
  std::ranges::sort(
      order, [&](std::uint32_t a, std::uint32_t b) { return std::tuple(position(a), a) < std::tuple(position(b), b); });
  std::vector<std::uint32_t> first(vertices.size());  // of the vertices at the same position
  for (std::size_t i = 0; i < order.size(); ++i)
    first[order[i]] = i > 0 && position(order[i]) == position(order[i - 1]) ? first[order[i - 1]] : order[i];

  constexpr std::uint32_t unused = 0xffffffffu;
  std::vector<std::uint32_t> number(vertices.size(), unused);
  given_.reserve(indices.size());
  for (std::size_t t = 0; t + 3 <= indices.size(); t += 3) {
    const std::uint32_t corners[] = {first[indices[t]], first[indices[t + 1]], first[indices[t + 2]]};
    if (!has_area(vertices[corners[0]], vertices[corners[1]], vertices[corners[2]])) continue;
    for (const std::uint32_t corner : corners) {
      if (number[corner] == unused) {
        number[corner] = static_cast<std::uint32_t>(mesh_.vertices_.size());
        mesh_.vertices_.push_back(vertices[corner] + Vec3{});  // avoids negative zeros
      }
      given_.push_back(number[corner]);
    }
    if (!numbers.empty()) numbers_.push_back(numbers[t / 3]);
  }
}

void MeshBuilder::make_tree() {
  const auto corner = [&](std::uint32_t triangle, std::size_t k) {
    return mesh_.vertices_[given_[3 * std::size_t{triangle} + k]];
  };
  const auto box_of = [&](std::uint32_t t) -> Aabb {
    const Vec3 a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
    return {min(a, min(b, c)), max(a, max(b, c))};
  };
  constexpr std::size_t leaf_size = 4;  // nodes then take 16 bytes per triangle
  std::vector<std::uint32_t> order;
  BoxTreeBuilder(given_.size() / 3, leaf_size, box_of, mesh_.nodes_, order);
  mesh_.indices_.reserve(given_.size());
  for (const std::uint32_t t : order)
    for (std::size_t k = 0; k < 3; ++k) mesh_.indices_.push_back(given_[3 * std::size_t{t} + k]);
  sort_vertices();
  mesh_.material_numbers_.reserve(numbers_.size());
  for (const std::uint32_t t : order)
    if (!numbers_.empty()) mesh_.material_numbers_.push_back(numbers_[t]);
  mesh_.bounds_ = {mesh_.nodes_[0].lower, mesh_.nodes_[0].upper};
}

// In the order in which the triangles use them: a search then finds the vertices of neighbours in the same cache lines.
void MeshBuilder::sort_vertices() {
  constexpr std::uint32_t none = 0xffffffffu;
  std::vector<std::uint32_t> number(mesh_.vertices_.size(), none);
  std::vector<Vec3> sorted;
  sorted.reserve(number.size());
  for (std::uint32_t& index : mesh_.indices_) {
    if (number[index] == none) {
      number[index] = static_cast<std::uint32_t>(sorted.size());
      sorted.push_back(mesh_.vertices_[index]);
    }
    index = number[index];
  }
  mesh_.vertices_ = std::move(sorted);
}

}  // namespace fathom
