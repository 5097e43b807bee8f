// Heaps of bodies other than cubes that fall into a bin.
#include <algorithm>
#include <cmath>
#include <fathom/compound.hpp>
#include <utility>
#include <vector>

#include "scene/environments.hpp"
#include "scene/heap_bodies.hpp"
#include "scene/scene_parts.hpp"

namespace fathom {
namespace {

constexpr std::uint64_t seed = 20201;
constexpr double ground_top = 0.5;  // m

/// A bin on the ground with room for `columns` × `columns` bodies of `size`, and bodies above it.
Scene heap_in_bin(std::string_view name, std::int64_t bodies, double size, float friction,
                  BodyDef (*next)(Random&, std::int64_t)) {
  constexpr double layers = 10, gap = 1.1;
  check_size(name, "bodies", bodies, max_environment_bodies - 5);
  Scene scene = scene_with_ground(name, bodies + 4);
  scene.bodies[0].material.friction = friction;
  const auto columns = static_cast<std::int64_t>(std::ceil(std::sqrt(static_cast<double>(bodies) / layers)));
  const double cell = gap * size, inside = 0.5 * cell * static_cast<double>(columns);
  // As high as all the falling bodies.
  const double rim = cell * (2 + static_cast<double>((bodies - 1) / (columns * columns)));
  const auto half_width = static_cast<float>(inside), half_rim = static_cast<float>(0.5 * rim);
  const auto middle = static_cast<float>(ground_top + 0.5 * rim);
  BodyDef wall;
  wall.motion = MotionType::fixed;
  wall.material.friction = friction;
  for (const float side : {-1.0f, 1.0f}) {
    wall.shape = box({1, half_width + 2, half_rim});
    wall.pose.position = {side * (half_width + 1), 0, middle};
    scene.bodies.push_back(wall);
    wall.shape = box({half_width, 1, half_rim});
    wall.pose.position = {0, side * (half_width + 1), middle};
    scene.bodies.push_back(wall);
  }
  Random random(seed);
  for (std::int64_t i = 0; i < bodies; ++i) {
    BodyDef body = next(random, i);
    body.material.friction = friction;
    const auto x = static_cast<double>(i % columns), y = static_cast<double>(i / columns % columns);
    const auto z = static_cast<double>(i / (columns * columns));
    // Not straight above each other: round bodies would stack.
    const double aside = 0.5 * (cell - size), off_x = random.symmetric(aside), off_y = random.symmetric(aside);
    body.pose.position = {static_cast<float>((x + 0.5) * cell - inside + off_x),
                          static_cast<float>((y + 0.5) * cell - inside + off_y),
                          static_cast<float>(ground_top + (z + 1) * cell)};
    body.pose.rotation = random_rotation(random);
    scene.bodies.push_back(body);
  }
  scene.container = Aabb{{-half_width, -half_width, 0.5f}, {half_width, half_width, 3e38f}};
  return scene;
}

BodyDef body_of(Shape shape) {
  BodyDef body;
  body.shape = std::move(shape);
  return body;
}

/// The hull of sixteen points on an ellipsoid up to 1.6 times as long as thin.
Shape rock(Random& random, double size) {
  const double half = 0.5 * size;
  const double b = half * (0.625 + 0.375 * random.unit()), c = half * (0.625 + 0.375 * random.unit());
  std::vector<Vec3> points;
  while (points.size() < 16) {
    const double x = random.symmetric(1), y = random.symmetric(1), z = random.symmetric(1);
    const double square = x * x + y * y + z * z;
    if (square > 1 || square < 0.01) continue;
    const double scale = 1 / std::sqrt(square);
    points.push_back(
        {static_cast<float>(half * scale * x), static_cast<float>(b * scale * y), static_cast<float>(c * scale * z)});
  }
  // Scaled about the centre of mass, which is its position, so that it is no larger than requested.
  const float scale = static_cast<float>(half) / hull(points).hull->outer_radius();
  for (Vec3& point : points) point *= scale;
  return hull(points);
}

/// One of eight rocks that bodies share.
const Shape& one_of_rocks(std::int64_t number) {
  static const std::vector<Shape> rocks = [] {
    Random random(seed + 1);
    std::vector<Shape> made;
    while (made.size() < 8) made.push_back(rock(random, 1));
    return made;
  }();
  return rocks[static_cast<std::size_t>(number) % rocks.size()];
}

/// A breakwater's tetrapod within a ball of 1 m: four legs of six sides each, from its middle to the ball.
Shape tetrapod() {
  constexpr float foot = 0.16f, tip = 0.11f;  // m, radii
  const float length = std::sqrt(0.25f - tip * tip);
  std::vector<ChildShape> legs;
  for (const Vec3 corner : {Vec3{1, 1, 1}, Vec3{1, -1, -1}, Vec3{-1, 1, -1}, Vec3{-1, -1, 1}}) {
    const Vec3 along = normalize(corner), across = any_perpendicular(along), third = cross(along, across);
    std::vector<Vec3> points;
    for (int i = 0; i < 6; ++i) {
      const Direction d(i / 6.0);
      const Vec3 out = static_cast<float>(d.x) * across + static_cast<float>(d.y) * third;
      points.push_back(foot * out);
      points.push_back(length * along + tip * out);
    }
    ChildShape leg{hull(points)};
    leg.pose.position = leg.shape.hull->offset();
    legs.push_back(std::move(leg));
  }
  return compound(legs);
}

}  // namespace

Shape mixed_shape(Random& random, std::int64_t number) {
  const double size = log_uniform(random, 0.1, 1), thin = size / log_uniform(random, 1, 2);
  const auto half = static_cast<float>(0.5 * size), half_thin = static_cast<float>(0.5 * thin);
  switch (number % 4) {
    case 0:
      return sphere(half);
    case 1:
      return capsule(half_thin, half - half_thin);
    case 2:
      return box(Vec3{half, half_thin, half_thin} * 0.7f);
    default:
      return rock(random, size);
  }
}

Scene rocks(std::int64_t bodies) {
  return heap_in_bin("rocks", bodies, 1, 0.5f,
                     [](Random&, std::int64_t number) { return body_of(one_of_rocks(number)); });
}

Scene spheres(std::int64_t bodies) {
  return heap_in_bin("spheres", bodies, 1, 0.5f, [](Random&, std::int64_t) { return body_of(sphere(0.5f)); });
}

Scene capsules(std::int64_t bodies) {
  return heap_in_bin("capsules", bodies, 1, 0.5f, [](Random&, std::int64_t) { return body_of(capsule(0.25f, 0.25f)); });
}

Scene tetrapods(std::int64_t bodies) {
  static const Shape shape = tetrapod();
  return heap_in_bin("tetrapods", bodies, 1, 0.5f, [](Random&, std::int64_t) { return body_of(shape); });
}

Scene mixed(std::int64_t bodies) {
  return heap_in_bin("mixed", bodies, 1, 0.2f,
                     [](Random& random, std::int64_t number) { return body_of(mixed_shape(random, number)); });
}

}  // namespace fathom
