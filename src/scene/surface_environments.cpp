// Environments with a surface or many bodies as ground: trees and the large world of Box3D's benchmark in our
// coordinates (its y is our z, its z our −y), and a landscape.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fathom/compound.hpp>
#include <fathom/mesh.hpp>
#include <vector>

#include "scene/environments.hpp"
#include "scene/heap_bodies.hpp"
#include "scene/scene_parts.hpp"

namespace fathom {
namespace {

/// Sine of the fraction t of a full turn.
double sine(double t) { return Direction(t - std::floor(t)).y; }

// --- trees ---------------------------------------------------------------------------------------------------

constexpr double trees_across = 150, trees_along = 200;  // m

/// Waves of 0.4 m height, 10 m and 20 m long.
Shape wavy_mesh(std::uint32_t cells_per_metre) {
  const auto columns = static_cast<std::uint32_t>(trees_across) * cells_per_metre;
  const auto rows = static_cast<std::uint32_t>(trees_along) * cells_per_metre;
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> indices;
  for (std::uint32_t j = 0; j <= rows; ++j)
    for (std::uint32_t i = 0; i <= columns; ++i) {
      const double x = static_cast<double>(i) / cells_per_metre, y = static_cast<double>(j) / cells_per_metre;
      vertices.push_back({static_cast<float>(x - 0.5 * trees_across), static_cast<float>(y - 0.5 * trees_along),
                          static_cast<float>(-0.4 * sine(x / 10) * sine(y / 20))});
    }
  for (std::uint32_t j = 0; j < rows; ++j)
    for (std::uint32_t i = 0; i < columns; ++i) {
      const std::uint32_t a = j * (columns + 1) + i, b = a + 1, d = a + columns + 1, c = d + 1;
      indices.insert(indices.end(), {a, b, c, a, c, d});
    }
  return mesh(vertices, indices);
}

/// A trunk of 22 stacked hexagonal prisms, each a twentieth thinner than the last, with its foot at the origin.
Shape tree() {
  std::vector<ChildShape> parts;
  double height = 1, radius = 0.75;
  constexpr double length = 1.5;
  for (int part = 0; part < 22; ++part) {
    std::vector<Vec3> points;
    for (int side = 0; side < 6; ++side)
      for (const double z : {height - radius, height + radius + length}) {
        const Direction d(side / 6.0);
        points.push_back({static_cast<float>(radius * d.x), static_cast<float>(-radius * d.y), static_cast<float>(z)});
      }
    ChildShape child;
    child.shape = hull(points);
    child.pose.position = child.shape.hull->offset();
    parts.push_back(child);
    height += length + 2 * radius;
    radius *= 0.95;
  }
  return compound(parts);
}

Scene trees(std::string_view name, std::int64_t bodies, std::uint32_t cells_per_metre) {
  check_size(name, "bodies", bodies, max_environment_bodies - 1);
  Scene scene = empty_scene(name, bodies + 1);
  scene.world.gravity = {0, 0, -10};
  BodyDef ground;
  ground.motion = MotionType::fixed;
  ground.shape = wavy_mesh(cells_per_metre);
  ground.material.friction = 0.6f;
  scene.bodies.push_back(ground);
  scene.ground_height = -0.4f;  // of the deepest valleys
  BodyDef body;
  body.shape = tree();
  body.density = 1;
  body.material.friction = 0.9f;
  const Vec3 middle = body.shape.compound->offset();
  // From −70 m on, 3 m apart, or closer if there are too many.
  const double apart = std::min(3.0, 150 / static_cast<double>(bodies));
  for (std::int64_t i = 0; i < bodies; ++i) {
    const Vec3 foot{0, static_cast<float>(70 - apart * static_cast<double>(i)), 1};
    const double share = static_cast<double>(i) / static_cast<double>(bodies);
    body.velocity.angular = {0, static_cast<float>((i % 2 == 0 ? 0.5 : -0.5) * (0.5 + 0.5 * share)), 0};
    body.velocity.linear = cross(body.velocity.angular, middle);
    body.pose.position = foot + middle;
    scene.bodies.push_back(body);
  }
  return scene;
}

// --- terrain -------------------------------------------------------------------------------------------------

constexpr std::uint32_t samples = 1000;
constexpr double field_cell = 0.5, field_half = 0.5 * field_cell * (samples - 1);  // m

/// A valley with bumps, up to 18° steep at its sides.
double landscape(double x, double y) {
  const double valley = x * x / 1500 + y * y / 3000;
  return valley + 0.4 * sine(x / 20) * sine(y / 25) + 0.1 * sine(x / 5) * sine(y / 6);
}

Shape landscape_field() {
  std::vector<float> heights;
  heights.reserve(std::size_t{samples} * samples);
  for (std::uint32_t j = 0; j < samples; ++j)
    for (std::uint32_t i = 0; i < samples; ++i)
      heights.push_back(static_cast<float>(landscape(field_cell * i - field_half, field_cell * j - field_half)));
  const auto cell = static_cast<float>(field_cell);
  return height_field({samples, samples, cell, cell, heights});
}

}  // namespace

Scene trees100(std::int64_t bodies) { return trees("trees100", bodies, 1); }
Scene trees50(std::int64_t bodies) { return trees("trees50", bodies, 2); }
Scene trees25(std::int64_t bodies) { return trees("trees25", bodies, 4); }

Scene large_world(std::int64_t bodies) {
  constexpr int side = 10;
  constexpr double tile = 10;  // m
  constexpr std::int64_t balls = side * side;
  check_size("large_world", "bodies", bodies, max_environment_bodies - balls);
  std::int64_t across = 1;
  while ((across + 1) * (across + 1) <= bodies) ++across;
  Scene scene = empty_scene("large_world", across * across + balls);
  scene.world.gravity = {0, 0, -10};
  BodyDef body;
  body.material.friction = 0.6f;
  body.motion = MotionType::fixed;
  body.shape = box({0.5f * static_cast<float>(tile), 0.5f * static_cast<float>(tile), 0.25f});
  const double half = 0.5 * tile * static_cast<double>(across);
  for (std::int64_t i = 0; i < across * across; ++i) {
    body.pose.position = {static_cast<float>(tile * (static_cast<double>(i % across) + 0.5) - half),
                          static_cast<float>(tile * (static_cast<double>(i / across) + 0.5) - half), 0};
    scene.bodies.push_back(body);
  }
  scene.ground_height = 0.25f;
  body.motion = MotionType::dynamic;
  body.shape = sphere(across > 1 ? 0.5f : 0.3f);  // a hundred would overlap on a single box
  const double inside = 0.8 * half;
  for (int i = 0; i < balls; ++i) {
    const auto at = [&](int k) { return static_cast<float>(inside * ((k + 0.5) * 2 / side - 1)); };
    body.pose.position = {at(i % side), at(i / side), 1.5f};
    scene.bodies.push_back(body);
  }
  return scene;
}

Scene terrain(std::int64_t bodies) {
  check_size("terrain", "bodies", bodies, 400'000);
  Scene scene = empty_scene("terrain", bodies + 1);
  BodyDef ground;
  ground.motion = MotionType::fixed;
  ground.shape = landscape_field();
  ground.pose.position = {static_cast<float>(-field_half), static_cast<float>(-field_half), 0};
  scene.bodies.push_back(ground);
  scene.ground_height = -0.5f;
  // Ten layers of columns 1.2 m apart on one side of the valley, 140 m from its bottom.
  const auto columns = static_cast<std::int64_t>(std::ceil(std::sqrt(static_cast<double>(bodies) / 10)));
  constexpr double apart = 1.2;
  Random random(20203);
  BodyDef body;
  for (std::int64_t i = 0; i < bodies; ++i) {
    const double x = -140 + apart * (static_cast<double>(i % columns) - 0.5 * static_cast<double>(columns - 1));
    const double y = apart * (static_cast<double>(i / columns % columns) - 0.5 * static_cast<double>(columns - 1));
    const double z = landscape(x, y) + 1 + apart * static_cast<double>(i / (columns * columns));
    body.shape = mixed_shape(random, i);
    body.pose.position = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
    body.pose.rotation = random_rotation(random);
    scene.bodies.push_back(body);
  }
  return scene;
}

}  // namespace fathom
