// Wavy ground for tests, as a mesh and as a height field.
#pragma once

#include <cmath>
#include <cstdint>
#include <fathom/mesh.hpp>
#include <fathom/world.hpp>
#include <memory>
#include <vector>

namespace fathom::test {

/// A bowl with waves (m); its rim is 2 to 3 m high at 5 m from the centre.
inline float wavy_bowl(float x, float y) {
  return 0.3f * std::sin(1.3f * x) * std::cos(1.1f * y) + 0.08f * (x * x + y * y);
}

/// Triangles over a grid of cells from (−half, −half) to (half, half), two per cell.
template <class Height>
Shape grid_mesh(int cells, float half, const Height& height) {
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> indices;
  const float cell = 2 * half / static_cast<float>(cells);
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i) {
      const float x = static_cast<float>(i) * cell - half, y = static_cast<float>(j) * cell - half;
      vertices.push_back({x, y, height(x, y)});
    }
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * (cells + 1) + i); };
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i) {
      for (const std::uint32_t k : {at(i, j), at(i + 1, j), at(i + 1, j + 1)}) indices.push_back(k);
      for (const std::uint32_t k : {at(i, j), at(i + 1, j + 1), at(i, j + 1)}) indices.push_back(k);
    }
  return mesh(vertices, indices);
}

inline Shape flat_mesh(int cells, float half) {
  return grid_mesh(cells, half, [](float, float) { return 0.0f; });
}

inline Shape wavy_mesh(int cells = 20, float half = 5) { return grid_mesh(cells, half, wavy_bowl); }

/// The same heights as a height field, which starts at its origin: place it at (−half, −half, 0).
inline Shape wavy_field(std::uint32_t samples = 21, float half = 5, std::vector<std::uint32_t> hole_cells = {}) {
  std::vector<float> heights;
  const float cell = 2 * half / static_cast<float>(samples - 1);
  for (std::uint32_t j = 0; j < samples; ++j)
    for (std::uint32_t i = 0; i < samples; ++i)
      heights.push_back(wavy_bowl(static_cast<float>(i) * cell - half, static_cast<float>(j) * cell - half));
  HeightFieldDef def{samples, samples, cell, cell, heights};
  const std::size_t cells = std::size_t{samples - 1} * (samples - 1);
  const auto holes = std::make_unique<bool[]>(cells);
  for (const std::uint32_t cell_number : hole_cells) holes[cell_number] = true;
  def.holes = {holes.get(), cells};
  return height_field(def);
}

/// A ball, a capsule, a box and a hull of about this half size (m).
inline std::vector<Shape> shapes_of(float size) {
  return {sphere(size), capsule(0.5f * size, size), box({size, 0.8f * size, 0.5f * size}),
          hull(std::vector<Vec3>{{-size, -size, -size},
                                 {size, -size, -size},
                                 {-size, size, -size},
                                 {size, size, -size},
                                 {0, 0, size},
                                 {-0.5f * size, 0, size},
                                 {0, 0.5f * size, size}})};
}

inline BodyDef fixed(const Shape& shape, Vec3 position = {}) {
  BodyDef def;
  def.motion = MotionType::fixed;
  def.shape = shape;
  def.pose.position = position;
  return def;
}

/// A heap of all shapes above the bowl.
inline std::vector<BodyDef> mixed_bodies(int count) {
  const Vec3 corners[] = {{0, 0, 0}, {0.6f, 0, 0}, {0, 0.6f, 0}, {0, 0, 0.6f}, {0.5f, 0.5f, 0.5f}};
  const Shape shapes[] = {box({0.3f, 0.25f, 0.2f}), sphere(0.3f), capsule(0.15f, 0.25f), hull(corners)};
  std::vector<BodyDef> bodies;
  for (int i = 0; i < count; ++i) {
    BodyDef def;
    def.shape = shapes[i % 4];
    def.pose.position = {static_cast<float>(i % 5) - 2.1f, static_cast<float>(i / 5 % 5) - 1.9f,
                         1.6f + 0.8f * static_cast<float>(i / 25)};
    def.pose.rotation = normalize(Quat{1, 0.1f * static_cast<float>(i % 7), 0.2f * static_cast<float>(i % 3), 0.1f});
    bodies.push_back(def);
  }
  return bodies;
}

}  // namespace fathom::test
