// Environments of bricks: a round wall and rows of straight ones, hit by heavy balls, like the demonstrations of
// Augmented Vertex Block Descent (Giles, Diaz, Yuksel, SIGGRAPH 2025); sizes and speeds are ours.
#include <algorithm>
#include <cmath>

#include "scene/environments.hpp"
#include "scene/scene_parts.hpp"

namespace fathom {
namespace {

// A brick's length is along the wall; it is as deep as long.
constexpr double brick_length = 0.5, brick_height = 0.25;
/// Spacing of bricks along the wall (m): they do not touch there.
constexpr double pitch = 1.01 * brick_length;
constexpr float ball_radius = 1, ball_mass = 200;  // m, kg; a brick has 1 kg
constexpr float ball_speed = 30;                   // m/s

BodyDef brick() {
  BodyDef body;
  body.shape = box({0.5f * static_cast<float>(brick_length), 0.5f * static_cast<float>(brick_length),
                    0.5f * static_cast<float>(brick_height)});
  body.mass = 1;
  return body;
}

/// Height of the centres of a course (m).
double height_of(std::int64_t course) {
  return 0.5 + (0.5 + static_cast<double>(course)) * brick_height;  // the ground's top is at 0.5 m
}

void add_ball(Scene& scene, double x, double y, double z, Vec3 velocity) {
  BodyDef ball;
  ball.shape = sphere(ball_radius);
  ball.mass = ball_mass;
  ball.pose.position = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  ball.velocity.linear = velocity;
  scene.bodies.push_back(ball);
}

}  // namespace

Scene ring(std::int64_t bodies) {
  check_size("ring", "bodies", bodies, max_environment_bodies - 3);
  Scene scene = scene_with_ground("ring", bodies + 2);
  // Twenty times as long as high, at least a ring of eight.
  const std::int64_t around =
      std::max<std::int64_t>(8, static_cast<std::int64_t>(std::sqrt(10.0 * static_cast<double>(bodies))));
  const double radius = pitch * static_cast<double>(around) / 6.283185307179586477 + 0.5 * brick_length;
  BodyDef body = brick();
  for (std::int64_t i = 0; i < bodies; ++i) {
    const std::int64_t course = i / around;
    // Bricks of odd courses straddle the joints below.
    const double position = static_cast<double>(i % around) + (course % 2 ? 0.5 : 0.0);
    const double turn = position / static_cast<double>(around);
    const Direction at(turn), half(0.5 * turn);
    body.pose.position = {static_cast<float>(radius * at.x), static_cast<float>(radius * at.y),
                          static_cast<float>(height_of(course))};
    body.pose.rotation = {static_cast<float>(half.x), 0, 0, static_cast<float>(half.y)};
    scene.bodies.push_back(body);
  }
  const double z = std::max(0.5 + 1.1 * static_cast<double>(ball_radius), height_of((bodies - 1) / around / 2));
  const double away = radius + 10;
  add_ball(scene, away, 0, z, {-ball_speed, 0, 0});
  add_ball(scene, -away, 0, z, {ball_speed, 0, 0});
  return scene;
}

Scene walls(std::int64_t bodies) {
  constexpr std::int64_t length = 50, courses = 20, wall = length * courses;
  constexpr double between = 4, beside = 30;  // m, walls of a row, rows
  check_size("walls", "bodies", bodies, max_environment_bodies / 2);
  const std::int64_t count = (bodies + wall - 1) / wall;
  // Rows about as deep as the total width.
  const auto rows = static_cast<std::int64_t>(std::ceil(std::sqrt(static_cast<double>(count) * between / beside)));
  const std::int64_t depth = (count + rows - 1) / rows;
  Scene scene = scene_with_ground("walls", bodies + rows);
  BodyDef body = brick();
  const double first_x = -0.5 * between * static_cast<double>(depth - 1);
  const double first_y = -0.5 * beside * static_cast<double>(rows - 1);
  for (std::int64_t i = 0; i < bodies; ++i) {
    const std::int64_t number = i / wall, course = i % wall / length;
    // Offset by a quarter of a brick from the joints below: more would leave the outermost ones unsupported.
    const double along =
        static_cast<double>(i % length) - 0.5 * static_cast<double>(length - 1) + (course % 2 ? 0.125 : -0.125);
    body.pose.position = {static_cast<float>(first_x + between * static_cast<double>(number % depth)),
                          static_cast<float>(first_y + beside * static_cast<double>(number / depth) + pitch * along),
                          static_cast<float>(height_of(course))};
    scene.bodies.push_back(body);
  }
  const std::int64_t high = std::min<std::int64_t>(courses, (bodies + length - 1) / length);
  const double z = std::max(0.5 + 1.1 * static_cast<double>(ball_radius), height_of(high / 2));
  for (std::int64_t row = 0; row < rows; ++row)
    add_ball(scene, first_x - 10, first_y + beside * static_cast<double>(row), z, {ball_speed, 0, 0});
  return scene;
}

}  // namespace fathom
