// Heaps on uneven ground: those of scene/heap.hpp, with a surface of triangles on the floor.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fathom/mesh.hpp>
#include <functional>

#include "scene/heap.hpp"
#include "scene/heap_bodies.hpp"
#include "scene/made_ground.hpp"

namespace fathom {
namespace {

constexpr std::uint64_t surface_stream = 0x7375726661636573;  // keeps the bodies' random numbers unchanged
constexpr int max_cells = 240;                                // per side

using Ground = std::function<double(double, double)>;

/// A square grid of cells about the origin.
struct Square {
  double half_side = 0, cell = 0;
  int cells = 0;

  double at(int i) const { return i * cell - half_side; }
};

Square square_under(const Heap& heap, double cell) {
  // Into the walls; out to the bin's corners if it turns.
  const double reach = static_cast<double>(heap.half_width + heap.floor_half_height);
  Square square;
  square.half_side = heap.kind == HeapKind::turning_floor ? 1.5 * reach : reach;
  square.cells = std::clamp(static_cast<int>(std::ceil(2 * square.half_side / cell)), 2, max_cells);
  square.cell = 2 * square.half_side / square.cells;
  return square;
}

/// Waves or hills, a third to eight times as long as the largest body, with no point above 0.
Ground random_ground(Random& random, const Heap& heap, double cell, double& height) {
  const double length = std::max(6 * cell, log_uniform(random, 0.35, 8) * heap.largest);
  height = length * log_uniform(random, 0.03, 0.3);
  const double lowered = 0.5 * height;
  const std::uint64_t seed = random.bits();
  if (random.bits() % 2 == 0)
    return [waves = Waves{height, length, seed}, lowered](double x, double y) { return waves.at(x, y) - lowered; };
  const double roughness = 0.3 + 0.4 * random.unit();
  const int layers = std::clamp(static_cast<int>(std::log2(length / (2 * cell))), 1, 5);
  return [hills = Hills{height, length, roughness, layers, seed}, lowered](double x, double y) {
    return hills.at(x, y) - lowered;
  };
}

Shape field_of(const Square& square, const Ground& ground) {
  const auto samples = static_cast<std::uint32_t>(square.cells + 1);
  std::vector<float> heights;
  for (int j = 0; j <= square.cells; ++j)
    for (int i = 0; i <= square.cells; ++i) heights.push_back(static_cast<float>(ground(square.at(i), square.at(j))));
  const auto cell = static_cast<float>(square.cell);
  return height_field({samples, samples, cell, cell, heights});
}

/// Jittered vertices, with diagonals in random directions.
Shape mesh_of(Random& random, const Square& square, const Ground& ground) {
  std::vector<Vec3> vertices;
  for (int j = 0; j <= square.cells; ++j)
    for (int i = 0; i <= square.cells; ++i) {
      const double x = square.at(i) + random.symmetric(0.3 * square.cell);
      const double y = square.at(j) + random.symmetric(0.3 * square.cell);
      vertices.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(ground(x, y))});
    }
  std::vector<std::uint32_t> indices;
  for (int j = 0; j < square.cells; ++j)
    for (int i = 0; i < square.cells; ++i) {
      const auto a = static_cast<std::uint32_t>(j * (square.cells + 1) + i), b = a + 1;
      const std::uint32_t d = a + static_cast<std::uint32_t>(square.cells) + 1, c = d + 1;
      if (random.bits() % 2 == 0)
        indices.insert(indices.end(), {a, b, c, a, c, d});
      else
        indices.insert(indices.end(), {a, b, d, b, c, d});
    }
  return mesh(vertices, indices);
}

}  // namespace

Heap make_surface_heap(std::uint64_t seed) {
  Heap heap = make_heap(seed);
  heap.scene.name = "surface_heap";
  Random random(seed ^ surface_stream);
  random.bits();
  BodyDef& floor = heap.scene.bodies.front();
  if (heap.kind == HeapKind::sliding_floor) {  // the surface would have to be as long as the floor slides
    heap.kind = HeapKind::bin;
    floor.motion = MotionType::fixed;
    floor.velocity = {};
  }
  const Square square = square_under(heap, log_uniform(random, 0.05, 0.6) * heap.largest);
  double height = 0;
  const Ground ground = random_ground(random, heap, square.cell, height);
  // A height field turns about its corner.
  const bool is_field = heap.kind != HeapKind::turning_floor && random.bits() % 2 == 0;
  BodyDef body = floor;
  body.shape = is_field ? field_of(square, ground) : mesh_of(random, square, ground);
  const Quat tilt = floor.pose.rotation;
  const auto corner = static_cast<float>(-square.half_side);
  body.pose.position = is_field ? rotate(tilt, {corner, corner, 0}) : Vec3{};
  // The floor is so deep that only a body that falls through the surface touches it.
  floor.pose.position += rotate(tilt, {0, 0, -static_cast<float>(height) - 2 * heap.floor_half_height});
  heap.lowest -= static_cast<float>(height);
  heap.surface = {heap.scene.bodies.size(), square.cell / heap.largest, height / heap.largest};
  heap.scene.names.push_back({"ground", heap.surface->body});
  heap.scene.bodies.push_back(body);
  return heap;
}

}  // namespace fathom
