// Scenes of Box3D's benchmark, in our coordinates: its y is our z, its z our −y.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "scene/environments.hpp"
#include "scene/scene_parts.hpp"

namespace fathom {
namespace {

constexpr double ground_top = 0.5;  // m
constexpr std::int64_t bodies_of_ten_rows = 55;
constexpr Material material{.friction = 0.6f, .restitution = 0};

Vec3 at(double x, double y, double z) {
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(ground_top + z)};
}

Scene benchmark_scene(std::string_view name, std::int64_t bodies) {
  Scene scene = scene_with_ground(name, bodies);
  scene.world.gravity = {0, 0, -10};
  scene.bodies[0].material = material;
  return scene;
}

BodyDef body_of(Shape shape, MotionType motion = MotionType::dynamic) {
  BodyDef body;
  body.shape = std::move(shape);
  body.material = material;
  body.motion = motion;
  return body;
}

/// Centre of a hull whose points were given relative to `position`.
Vec3 centre_of(const Shape& shape, Vec3 position) { return position + shape.hull->offset(); }

BodyDef cube_of(float half, float density) {
  BodyDef body = body_of(box({half, half, half}));
  body.density = density;
  return body;
}

/// A pyramid of 1 m cubes, one deep, whose lowest row begins at x.
void add_flat_pyramid(Scene& scene, std::int64_t rows, double x, double y) {
  BodyDef body = cube_of(0.5f, 100);
  for (std::int64_t row = 0; row < rows; ++row)
    for (std::int64_t i = row; i < rows; ++i) {
      const double aside = static_cast<double>(i) - 0.5 * static_cast<double>(row);
      body.pose.position = at(x + 0.5 + aside, y, 0.5 + static_cast<double>(row));
      scene.bodies.push_back(body);
    }
}

/// PEEL's generator, from which Box3D's scene has its points.
class PeelRandom {
 public:
  /// In [−0.5, 0.5].
  float next() {
    state_ = state_ * 2147001325u + 715136305u;
    return static_cast<float>(state_ & 0xffff) / 65535.0f - 0.5f;
  }

  Vec3 direction() {
    for (;;) {
      const float x = next();
      const float y = next();
      const float z = next();
      const Vec3 point{x, -z, y};
      if (length_squared(point) <= 0.25f) return normalize(point);
    }
  }

 private:
  std::uint32_t state_ = 42;
};

/// A prism between two copies of the points of `ring`, shifted by −half and +half.
template <std::size_t n>
Shape prism(const std::array<Vec3, n>& ring, Vec3 half) {
  std::vector<Vec3> points;
  for (const Vec3 point : ring) points.push_back(point - half), points.push_back(point + half);
  return hull(points);
}

/// Forty parts of a drum about the y axis: 36 of its wall and four blades.
void add_drum(Scene& scene, Vec3 middle, double scale) {
  const auto point = [&](double radius, double thirty_sixths) {
    const Direction d(thirty_sixths / 36);
    return Vec3{static_cast<float>(scale * radius * d.x), 0, static_cast<float>(scale * radius * d.y)};
  };
  const Vec3 half{0, static_cast<float>(10 * scale), 0};
  const auto add = [&](const std::array<Vec3, 4>& ring) {
    BodyDef part = body_of(prism(ring, half), MotionType::kinematic);
    part.pose.position = centre_of(part.shape, middle);
    scene.bodies.push_back(part);
  };
  for (int i = 0; i < 36; ++i) {
    // Wall parts overlap by a twentieth.
    const double from = i - 0.05, to = i + 1.05;
    add({point(16, from), point(18, from), point(16, to), point(18, to)});
    if (i % 9 == 0) add({point(14, i), point(16, i), point(14, i + 1), point(16, i + 1)});
  }
}

/// Ten points of a Fibonacci lattice on a sphere.
Shape rock(double radius) {
  constexpr int count = 10;
  constexpr double golden = 0.618033988749894848;
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) {
    const double height = 1 - (2 * i + 1.0) / count, out = std::sqrt(1 - height * height);
    const Direction around(golden * i);
    // Its z, up in the lattice, is our −y.
    points.push_back({static_cast<float>(radius * out * around.x), static_cast<float>(-radius * height),
                      static_cast<float>(radius * out * around.y)});
  }
  return hull(points);
}

void add_yard(Scene& scene) {
  BodyDef wall = body_of({}, MotionType::fixed);
  for (const double side : {-1.0, 1.0}) {
    wall.shape = box({1, 50, 8});
    wall.pose.position = at(50 * side, 0, 7);
    scene.bodies.push_back(wall);
    wall.shape = box({50, 1, 8});
    wall.pose.position = at(0, 50 * side, 7);
    scene.bodies.push_back(wall);
  }
}

void add_pusher(Scene& scene) {
  constexpr double away = 35, height = 24, radius = 4;
  std::array<Vec3, 16> ring;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Direction d(static_cast<double>(i) / 16);
    ring[i] = {static_cast<float>(radius * d.x), static_cast<float>(-radius * d.y), 0};
  }
  BodyDef pusher = body_of(prism(ring, {0, 0, static_cast<float>(0.5 * height)}), MotionType::kinematic);
  pusher.pose.position = at(away, 0, 0.5 * height);
  scene.orbit = Orbit{.first = scene.bodies.size(),
                      .count = 1,
                      .centre = at(0, 0, 0.5 * height),
                      .axis = {0, 0, 1},
                      .speed = 6.0 / 360,
                      .is_rigid = false};
  scene.names.push_back({"pusher", scene.bodies.size()});
  scene.bodies.push_back(pusher);
}

std::int64_t rows_of(std::int64_t bodies) {
  std::int64_t rows = 0;
  while (triangle_bodies(rows + 1) <= bodies) ++rows;
  return rows;
}

std::int64_t root_above(std::int64_t n, double (*root)(double), std::int64_t (*power)(std::int64_t)) {
  auto side = static_cast<std::int64_t>(root(static_cast<double>(n)));
  while (power(side) < n) ++side;
  return side;
}

}  // namespace

std::int64_t triangle_bodies(std::int64_t rows) {
  // The product would overflow, and no world is that large.
  if (rows > 1'000'000) return std::numeric_limits<std::int64_t>::max();
  return rows * (rows + 1) / 2;
}

std::int64_t large_pyramid_bodies(std::int64_t bodies) { return triangle_bodies(rows_of(bodies)); }

std::int64_t many_pyramids_bodies(std::int64_t bodies) {
  return std::max<std::int64_t>(1, bodies / bodies_of_ten_rows) * bodies_of_ten_rows;
}

Scene large_pyramid(std::int64_t bodies) {
  check_size("large_pyramid", "bodies", bodies, max_environment_bodies - 1);
  const std::int64_t rows = rows_of(bodies);
  Scene scene = benchmark_scene("large_pyramid", bodies);
  add_flat_pyramid(scene, rows, -0.5 * static_cast<double>(rows), 0);
  return scene;
}

Scene many_pyramids(std::int64_t bodies) {
  constexpr std::int64_t rows = 10, each = bodies_of_ten_rows;
  check_size("many_pyramids", "bodies", bodies, max_environment_bodies - each);
  const std::int64_t count = many_pyramids_bodies(bodies) / each;
  const std::int64_t columns = root_above(count, std::sqrt, [](std::int64_t n) { return n * n; });
  Scene scene = benchmark_scene("many_pyramids", count * each);
  const double extent = 0.5 * static_cast<double>(columns * (rows + 1));
  const double apart = columns > 1 ? 2 * (extent - 1) / static_cast<double>(columns - 1) : 0;
  for (std::int64_t i = 0; i < count; ++i)
    add_flat_pyramid(scene, rows, -extent + 0.5 + static_cast<double>((rows + 1) * (i % columns)),
                     extent - 1 - apart * static_cast<double>(i / columns));
  return scene;
}

Scene wide_pyramid(std::int64_t bodies) {
  check_size("wide_pyramid", "bodies", bodies, max_environment_bodies - 1);
  const std::int64_t layers = pyramid_layers(bodies);
  Scene scene = benchmark_scene("wide_pyramid", pyramid_bodies(layers));
  BodyDef body = cube_of(0.975f, 1000);
  for (std::int64_t layer = 0; layer < layers; ++layer) {
    const std::int64_t side = layers - layer;
    const double first = -static_cast<double>(side - 1);
    for (std::int64_t i = 0; i < side * side; ++i) {
      const auto column = static_cast<double>(i % side), row = static_cast<double>(i / side);
      body.pose.position = at(first + 2 * column, first + 2 * row, 1 + 2.5 * static_cast<double>(layer));
      scene.bodies.push_back(body);
    }
  }
  return scene;
}

Scene washer(std::int64_t bodies) {
  constexpr std::int64_t parts = 40;
  check_size("washer", "bodies", bodies, max_environment_bodies - parts - 1);
  Scene scene = benchmark_scene("washer", bodies + parts);
  const std::int64_t side = root_above(bodies, std::cbrt, [](std::int64_t n) { return n * n * n; });
  const double scale = std::max(1.0, static_cast<double>(side) / 20);
  const Vec3 middle = at(0, 0, 3 + 18 * scale);
  add_drum(scene, middle, scale);
  scene.orbit = Orbit{.first = 1, .count = parts, .centre = middle, .axis = {0, -1, 0}, .speed = 25.0 / 360};
  BodyDef body = cube_of(0.2f, 1000);
  const double first = -0.4 * static_cast<double>(side);
  for (std::int64_t i = 0; i < bodies; ++i) {
    const auto x = static_cast<double>(i % side), y = static_cast<double>(i / side % side);
    const auto z = static_cast<double>(i / side / side);
    body.pose.position = middle + Vec3{static_cast<float>(first + 0.8 * x), static_cast<float>(first + 0.8 * y),
                                       static_cast<float>(first + 0.8 * z)};
    scene.bodies.push_back(body);
  }
  // Half way through the wall. The ends are open.
  const auto within = static_cast<float>(17 * scale);
  scene.container = Aabb{middle - Vec3{within, 3e38f, within}, middle + Vec3{within, 3e38f, within}};
  return scene;
}

Scene joint_grid(std::int64_t bodies) {
  check_size("joint_grid", "bodies", bodies, max_environment_bodies / 2);
  // With the top row, which does not move, square if the number allows.
  const std::int64_t columns = root_above(bodies, std::sqrt, [](std::int64_t n) { return n * n; });
  const std::int64_t rows = (bodies + columns - 1) / columns;
  Scene scene = empty_scene("joint_grid", bodies + columns);
  scene.world.gravity = {0, 0, -10};
  BodyDef ball = body_of(sphere(0.4f));
  ball.filter = {2, ~2u};  // no contacts
  const auto join = [&](std::size_t a, Vec3 towards) {
    scene.joints.push_back({a, scene.bodies.size() - 1, ball_joint({}, {}, 0.5f * towards, -0.5f * towards)});
  };
  for (std::int64_t row = 0; row <= rows; ++row) {
    ball.motion = row == 0 ? MotionType::fixed : MotionType::dynamic;
    const std::int64_t across = row < rows ? columns : bodies - (rows - 1) * columns;
    for (std::int64_t column = 0; column < across; ++column) {
      const std::size_t index = scene.bodies.size();
      ball.pose.position =
          at(static_cast<double>(column) - 0.5 * static_cast<double>(columns - 1), 0, static_cast<double>(rows - row));
      scene.bodies.push_back(ball);
      if (row > 0) join(index - static_cast<std::size_t>(columns), {0, 0, -1});
      if (row > 0 && column > 0) join(index - 1, {1, 0, 0});
    }
  }
  return scene;
}

Scene convex_pile(std::int64_t bodies) {
  constexpr std::int64_t side = 8;
  constexpr double radius = 2;
  check_size("convex_pile", "bodies", bodies, max_environment_bodies - 1);
  Scene scene = benchmark_scene("convex_pile", bodies);
  PeelRandom random;
  std::vector<Vec3> points;
  for (int i = 0; i < 32; ++i) points.push_back(static_cast<float>(radius) * random.direction());
  BodyDef body = body_of(hull(points));
  for (std::int64_t i = 0; i < bodies; ++i) {
    const auto column = static_cast<double>(i % side), row = static_cast<double>(i / side % side);
    const auto layer = static_cast<double>(i / (side * side));
    const double half = 0.5 * side;
    body.pose.position = centre_of(
        body.shape, at(2 * radius * (column - half), -2 * radius * (row - half), radius + 2 * radius * layer));
    scene.bodies.push_back(body);
  }
  return scene;
}

Scene junkyard(std::int64_t bodies) {
  constexpr std::int64_t side = 21;
  check_size("junkyard", "bodies", bodies, max_environment_bodies - 6);
  Scene scene = benchmark_scene("junkyard", bodies + 5);
  add_yard(scene);
  add_pusher(scene);
  BodyDef body = body_of(rock(1.5));
  for (std::int64_t i = 0; i < bodies; ++i) {
    const auto column = static_cast<double>(i % side), row = static_cast<double>(i / side % side);
    const auto layer = static_cast<double>(i / (side * side));
    body.pose.position = centre_of(body.shape, at(-40 + 4 * column, 40 - 4 * row, 25 + 4 * layer));
    scene.bodies.push_back(body);
  }
  return scene;
}

}  // namespace fathom
