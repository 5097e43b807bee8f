// Nothing catches on the seams of a floor: those of a mesh, of tiles that are separate bodies, of the children of a
// compound, of meshes side by side, of fixed and kinematic bodies. Obstacles that protrude from the floor still stop
// bodies.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fathom/compound.hpp>
#include <fathom/mesh.hpp>
#include <numbers>

#include "validate/bodies.hpp"
#include "validate/case_list.hpp"

namespace fathom::validate {
namespace {

constexpr float floor_width = 6, body_size = 0.2f;

/// From (0, 0, 0) along x and to both sides.
Shape flat_mesh(float length, int cells_along, int cells_across) {
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> indices;
  const float dx = length / static_cast<float>(cells_along), dy = floor_width / static_cast<float>(cells_across);
  for (int i = 0; i <= cells_along; ++i)
    for (int j = 0; j <= cells_across; ++j)
      vertices.push_back({static_cast<float>(i) * dx, static_cast<float>(j) * dy - 0.5f * floor_width, 0});
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(i * (cells_across + 1) + j); };
  for (int i = 0; i < cells_along; ++i)
    for (int j = 0; j < cells_across; ++j)
      for (const std::uint32_t k : {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1)})
        indices.push_back(k);
  return mesh(vertices, indices);
}

void add_floor(World& world, const Shape& shape, Vec3 position, float friction, MotionType motion = MotionType::fixed) {
  BodyDef def;
  def.motion = motion;
  def.shape = shape;
  def.pose.position = position;
  def.material.friction = friction;
  world.add(def);
}

/// Cubes with this edge length, their tops at 0, starting at x = from; every other row is offset by half a tile, so
/// that seams meet seams.
template <class Add>
void for_each_tile(float from, float length, float edge, Add add) {
  const int rows = static_cast<int>(std::ceil(length / edge)), across = static_cast<int>(std::ceil(floor_width / edge));
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j <= across; ++j) {
      const float aside = (static_cast<float>(j) - (i % 2 == 0 ? 0.0f : 0.5f)) * edge - 0.5f * floor_width;
      add(Vec3{from + (static_cast<float>(i) + 0.5f) * edge, aside, -0.5f * edge});
    }
}

void add_tiles(World& world, float from, float length, float edge, float friction) {
  const Shape tile = box({0.5f * edge, 0.5f * edge, 0.5f * edge});
  for_each_tile(from, length, edge, [&](Vec3 position) { add_floor(world, tile, position, friction); });
}

struct Floor {
  const char* name;
  void (*add)(World& world, float length, float friction);
};

constexpr std::array floors{
    Floor{"tiles of 0.25 m", [](World& w, float l, float friction) { add_tiles(w, 0, l, 0.25f, friction); }},
    Floor{"tiles of 1 m", [](World& w, float l, float friction) { add_tiles(w, 0, l, 1, friction); }},
    Floor{"tiles of 3 m", [](World& w, float l, float friction) { add_tiles(w, 0, l, 3, friction); }},
    Floor{"a mesh", [](World& w, float l,
                       float friction) { add_floor(w, flat_mesh(l, static_cast<int>(8 * l), 60), {}, friction); }},
    Floor{"meshes of 2 m",
          [](World& w, float l, float friction) {
            const Shape part = flat_mesh(2, 5, 15);
            for (float x = 0; x < l; x += 2) add_floor(w, part, {x, 0, 0}, friction);
          }},
    Floor{"meshes and tiles",
          [](World& w, float l, float friction) {
            const Shape part = flat_mesh(2, 5, 15);
            for (float x = 0; x < l; x += 4) {
              add_floor(w, part, {x, 0, 0}, friction);
              add_tiles(w, x + 2, 2, 0.5f, friction);
            }
          }},
    Floor{"fixed and kinematic tiles",
          [](World& w, float l, float friction) {
            const Shape tile = box({0.5f, 0.5f, 0.5f});
            for_each_tile(0, l, 1, [&, k = 0](Vec3 position) mutable {
              add_floor(w, tile, position, friction, k++ % 2 == 0 ? MotionType::fixed : MotionType::kinematic);
            });
          }},
    Floor{"a compound of tiles",
          [](World& w, float l, float friction) {
            std::vector<ChildShape> children;
            const Shape tile = box({0.5f, 0.5f, 0.5f});
            for_each_tile(0, l, 1,
                          [&](Vec3 position) { children.push_back({.shape = tile, .pose = {.position = position}}); });
            const Shape all = compound(children);
            add_floor(w, all, all.compound->offset(), friction);
          }},
};

struct Slider {
  const char* name;
  Shape shape;
  Quat rotation{};
};

std::vector<Slider> sliders() {
  constexpr double quarter = 0.5 * std::numbers::pi;
  std::vector<Vec3> corners;
  for (int i = 0; i < 7; ++i) {
    const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(i) / 7;
    const Vec3 side{std::cos(angle), std::sin(angle), 0};
    corners.push_back(1.2f * body_size * side + Vec3{0, 0, -body_size});
    corners.push_back(body_size * side + Vec3{0, 0, 0.5f * body_size});
  }
  return {{"box", box({body_size, body_size, body_size})},
          {"turned box", box({body_size, body_size, body_size}), turn_about({0, 0, 1}, 0.6)},
          {"plank", box({5 * body_size, body_size, 0.1f * body_size}), turn_about({0, 0, 1}, 0.3)},
          {"ball", sphere(body_size)},
          {"capsule along", capsule(0.5f * body_size, body_size), turn_about({0, 1, 0}, quarter)},
          {"capsule across", capsule(0.5f * body_size, body_size), turn_about({1, 0, 0}, quarter)},
          {"cylinder", cylinder(body_size, body_size)},
          {"hull", hull(corners)}};
}

struct Slid {
  double lost = 0;  ///< fraction of the speed
  double off = 0;   ///< change of height (m)
};

/// Along the floor, slightly askew.
Slid slide(const Setup& setup, const Floor& floor, const Slider& slider, float speed, float length) {
  World world(world_def(setup));
  floor.add(world, length + 4, 0);
  BodyDef def;
  def.shape = slider.shape;
  def.material.friction = 0;
  def.pose.rotation = slider.rotation;
  def.pose.position = {1.13f, -0.5f, 0};
  BodyId body = world.add(def);
  def.pose.position.z = -world.bounds(body).lower.z + 1e-3f;
  world.set_pose(body, def.pose);
  for (int i = 0; i < 90; ++i) world.step();
  const float z = world.pose(body).position.z;
  const Vec3 along{speed * std::cos(0.01f), speed * std::sin(0.01f), 0};
  world.set_velocity(body, along, {});
  Slid slid;
  const int steps = static_cast<int>(length / (speed * world.definition().dt));
  for (int i = 0; i < steps; ++i) {
    world.step();
    slid.off = std::max(slid.off, wide(std::abs(world.pose(body).position.z - z)));
  }
  slid.lost = wide(fathom::length(world.velocity(body).linear - along)) / wide(speed);
  return slid;
}

std::string text(const char* format, double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

/// A frictionless body slides over tiles and meets an obstacle that is not a seam, 0.4 m ahead.
double speed_after(const Setup& setup, const Shape& shape, const Shape& obstacle, Vec3 position, float speed = 2) {
  World world(world_def(setup));
  add_tiles(world, 0, 4, 0.5f, 0);
  add_floor(world, obstacle, position, 0);
  BodyDef def = body(shape, {1, 0, body_size}, std::nullopt, {.friction = 0});
  def.velocity.linear = {speed, 0, 0};
  const BodyId id = world.add(def);
  steps(world, step_count(world, 1));
  return wide(world.velocity(id).linear.x);
}

/// Sideways deviation of a ball that rolls over tiles at 2 m/s.
double aside(const Setup& setup, float edge, float length) {
  World world(world_def(setup));
  add_tiles(world, 0, length + 4, edge, 0.5f);
  BodyDef def = body(sphere(body_size), {1.1f, 0.137f, body_size});
  def.velocity = {{2, 0, 0}, 0, {0, 2 / body_size, 0}, 0};
  const BodyId id = world.add(def);
  steps(world, step_count(world, wide(length) / 2));
  return std::abs(wide(world.pose(id).position.y) - 0.137);
}

}  // namespace

void seams(const Setup& setup, Record& record) {
  const float length = setup.full ? 100 : 20;
  Table table{"Worst of eight shapes at 1, 8 and 30 m/s", {"floor", "speed lost (%)", "off in height (mm)"}, {}};
  const std::vector<Slider> all = sliders();
  for (const Floor& floor : floors) {
    Slid worst;
    for (const Slider& slider : all)
      for (const float speed : {1.0f, 8.0f, 30.0f}) {
        const Slid slid = slide(setup, floor, slider, speed, std::min(length, 15 * speed));
        worst.lost = std::max(worst.lost, slid.lost);
        worst.off = std::max(worst.off, slid.off);
      }
    const std::string name = floor.name;
    record.at_most(name + ": speed lost", worst.lost, 1e-3);
    record.at_most(name + ": off in height", worst.off, 1e-3, "m");
    table.rows.push_back({name, text("%.2g", 100 * worst.lost), text("%.2g", 1000 * worst.off)});
  }
  record.tables.push_back(std::move(table));
  for (const float edge : {0.25f, 1.0f})
    record.at_most("a ball rolls over tiles of " + text("%g", wide(edge)) + " m: aside", aside(setup, edge, length),
                   2e-3, "m");
  const Shape cube = box({body_size, body_size, body_size});
  for (const Shape& shape : {cube, sphere(body_size), cylinder(body_size, body_size)}) {
    const std::string name = shape.type == ShapeType::box    ? "a box"
                             : shape.type == ShapeType::hull ? "a cylinder"
                                                             : "a ball";
    record.at_most(name + " at a wall", speed_after(setup, shape, box({0.1f, 2, 1}), {1.7f, 0, 0.9f}), 0.01, "m/s");
    record.at_most(name + " at a kerb of 10 cm", speed_after(setup, shape, box({0.5f, 2, 0.5f}), {2.1f, 0, -0.4f}),
                   0.01, "m/s");
  }
  record.at_most("a box at a step of 5 mm", speed_after(setup, cube, box({0.5f, 2, 0.5f}), {2.1f, 0, -0.495f}, 0.5f),
                 0.01, "m/s");
}

}  // namespace fathom::validate
