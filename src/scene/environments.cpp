#include "scene/environments.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "scene/scene_parts.hpp"

namespace fathom {
namespace {

constexpr std::int64_t max_bodies = max_environment_bodies;
constexpr std::int64_t layer_side = 10;
constexpr std::int64_t layer_bodies = layer_side * layer_side;
constexpr std::uint64_t drift_seed = 12345;
constexpr std::uint64_t kick_seed = 777;

constexpr float half_cube = 0.5f;

BodyDef cube() {
  BodyDef body;
  body.shape = box({half_cube, half_cube, half_cube});
  body.mass = 1.0f;
  return body;
}

/// Adds the first `bodies` of columns × columns cubes at height z, `spacing` apart and centred on the z axis.
void add_square(Scene& scene, std::int64_t columns, std::int64_t bodies, double spacing, double z) {
  const double centre = 0.5 * static_cast<double>(columns - 1);
  BodyDef body = cube();
  for (std::int64_t i = 0; i < bodies; ++i) {
    const std::int64_t column = i % columns, row = i / columns;
    const double x = spacing * (static_cast<double>(column) - centre);
    const double y = spacing * (static_cast<double>(row) - centre);
    body.pose.position = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
    scene.bodies.push_back(body);
  }
}

std::int64_t square_root(std::int64_t n) {
  auto root = static_cast<std::int64_t>(std::sqrt(static_cast<double>(n)));
  while (root * root > n) --root;
  while ((root + 1) * (root + 1) <= n) ++root;
  return root;
}

std::int64_t layers_bodies(std::int64_t count) { return count > max_bodies ? count : count * layer_bodies; }

std::int64_t square_bodies(std::int64_t bodies) { return square_root(bodies) * square_root(bodies); }

std::int64_t whole_pyramid_bodies(std::int64_t bodies) { return pyramid_bodies(pyramid_layers(bodies)); }

Scene pyramid_of_bodies(std::int64_t bodies) {
  check_size("pyramid", "bodies", bodies, max_bodies - 1);
  return pyramid(pyramid_layers(bodies));
}

constexpr std::array<Environment, 26> table{{
    {"drift", "adrift without gravity: random poses in a cube of n·(4 m)³, a random kick every 30 steps", 1000, nullptr,
     drift},
    {"layers", "a tower of 10 × 10 layers that fall on each other: a pile", 1000, layers_bodies, layers},
    {"spread", "⌊√n⌋ × ⌊√n⌋ bodies side by side on the ground: independent contacts", 1000, nullptr, spread,
     square_bodies},
    {"pyramid", "L² bodies at the bottom, one at the top: a stack that must stand", 385, pyramid_bodies,
     pyramid_of_bodies, whole_pyramid_bodies},
    {"ring", "a round wall of n bricks, hit by two heavy balls", 1000, nullptr, ring},
    {"walls", "straight walls of 1,000 bricks, n bricks in all, hit by heavy balls", 1000, nullptr, walls},
    {"large_pyramid", "a flat pyramid of L rows of cubes, one deep (Box3D's benchmark)", 5050, triangle_bodies,
     large_pyramid, large_pyramid_bodies},
    {"many_pyramids", "flat pyramids of 10 rows, 55 cubes each, in a field (Box3D's)", 10780, nullptr, many_pyramids,
     many_pyramids_bodies},
    {"wide_pyramid", "L² boxes of 1.95 m at the bottom, layers 0.5 m apart that fall on each other (Box3D's)", 1240,
     pyramid_bodies, wide_pyramid, whole_pyramid_bodies},
    {"washer", "small cubes in a drum that turns (Box3D's)", 8000, nullptr, washer},
    {"convex_pile", "a tower of 8 × 8 hulls per layer, of 32 points each, that falls into a pile (Box3D's)", 5120,
     nullptr, convex_pile},
    {"junkyard", "rocks, hulls of 10 points, that fall into a yard in which a column goes round (Box3D's)", 10584,
     nullptr, junkyard},
    {"joint_grid", "a net of balls, its top row fixed, held together by ball joints (Box3D's)", 9900, nullptr,
     joint_grid},
    {"chains", "chains of 20 links with 20 times a link's mass at the end, let go level", 1050, nullptr, chains},
    {"ragdolls", "ragdolls of 14 capsules with limited joints that fall from 20 m, 3 in a cell (after Box3D's rain)",
     4200, nullptr, ragdolls},
    {"rain", "the same on triangle meshes: a square and a torus in each cell (after Box3D's)", 4200, nullptr, rain},
    {"trees100", "trees of 22 hulls that fall over on a mesh of 1 m cells (Box3D's)", 50, nullptr, trees100},
    {"trees50", "the same on a mesh of 0.5 m cells", 50, nullptr, trees50},
    {"trees25", "and of 0.25 m cells, 960,000 triangles", 50, nullptr, trees25},
    {"large_world", "fixed boxes of 10 m in a square field, and 100 balls that fall on them (after Box3D's)", 1'000'000,
     nullptr, large_world, square_bodies},
    {"terrain", "bodies of all shapes that roll into the valley of a height field of 1,000 × 1,000 samples", 10'000,
     nullptr, terrain},
    {"rocks", "hulls of 16 points of many forms that fall into a bin", 3000, nullptr, rocks},
    {"spheres", "balls that fall into a bin", 3000, nullptr, spheres},
    {"capsules", "capsules that fall into a bin", 3000, nullptr, capsules},
    {"tetrapods", "a breakwater's units of four legs, compounds of hulls, that fall into a bin", 1000, nullptr,
     tetrapods},
    {"mixed", "balls, capsules, boxes and hulls, the largest ten times the smallest, that fall into a bin", 1000,
     nullptr, mixed},
}};

}  // namespace

Scene drift(std::int64_t bodies) {
  check_size("drift", "bodies", bodies, max_bodies);
  Scene scene = empty_scene("drift", bodies);
  scene.world.gravity = {0, 0, 0};
  scene.kicks = Kicks{.interval = 30, .linear = 0.5f, .angular = 0.5f, .seed = kick_seed};
  const double half_side = 2.0 * std::cbrt(static_cast<double>(bodies));
  Random random(drift_seed);
  BodyDef body = cube();
  for (std::int64_t i = 0; i < bodies; ++i) {
    const double x = random.symmetric(half_side), y = random.symmetric(half_side), z = random.symmetric(half_side);
    body.pose.position = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
    body.pose.rotation = random_rotation(random);
    scene.bodies.push_back(body);
  }
  return scene;
}

Scene layers(std::int64_t bodies) {
  check_size("layers", "bodies", bodies, max_bodies - 1);
  Scene scene = scene_with_ground("layers", bodies);
  for (std::int64_t first = 0; first < bodies; first += layer_bodies) {
    const std::int64_t layer = first / layer_bodies;
    const double z = 1.0 + 1.5 * static_cast<double>(layer);
    add_square(scene, layer_side, std::min(layer_bodies, bodies - first), 1.1, z);
  }
  return scene;
}

Scene spread(std::int64_t bodies) {
  check_size("spread", "bodies", bodies, max_bodies - 1);
  const std::int64_t side = square_root(bodies);
  constexpr double spacing = 1.1;
  Scene scene = scene_with_ground("spread", side * side, spacing * static_cast<double>(side));
  add_square(scene, side, side * side, spacing, 1.0);
  return scene;
}

Scene pyramid(std::int64_t layers) {
  check_size("pyramid", "layers", layers, pyramid_layers(max_bodies - 1));
  Scene scene = scene_with_ground("pyramid", pyramid_bodies(layers));
  for (std::int64_t layer = 0; layer < layers; ++layer) {
    const std::int64_t side = layers - layer;
    add_square(scene, side, side * side, 1.05, 1.0 + static_cast<double>(layer));
  }
  return scene;
}

std::int64_t pyramid_bodies(std::int64_t layers) {
  // The product would overflow, and no world is that large.
  if (layers > 1'000'000) return std::numeric_limits<std::int64_t>::max();
  return layers * (layers + 1) * (2 * layers + 1) / 6;
}

std::int64_t pyramid_layers(std::int64_t bodies) {
  std::int64_t layers = 0;
  while (pyramid_bodies(layers + 1) <= bodies) ++layers;
  return layers;
}

std::span<const Environment> environments() { return table; }

const Environment* find_environment(std::string_view name) {
  const auto found =
      std::find_if(table.begin(), table.end(), [name](const Environment& candidate) { return candidate.name == name; });
  return found == table.end() ? nullptr : &*found;
}

}  // namespace fathom
