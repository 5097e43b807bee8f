#include "scene/scene_parts.hpp"

#include <cmath>
#include <string>

namespace fathom {
namespace {

const Vec3 ground_half_extents{500, 500, 0.5f};

}  // namespace

void check_size(std::string_view environment, std::string_view unit, std::int64_t size, std::int64_t most) {
  const auto text = [&](const std::string& remedy) {
    return std::string(environment) + ": " + std::to_string(size) + " " + std::string(unit) + " asked for; " + remedy;
  };
  if (size < 1) throw Error(ErrorCode::invalid_argument, text("ask for at least 1"));
  if (size > most) throw Error(ErrorCode::capacity, text("a world holds at most " + std::to_string(most)));
}

Scene empty_scene(std::string_view name, std::int64_t bodies) {
  Scene scene;
  scene.name = name;
  scene.world.sleep.enabled = false;
  scene.bodies.reserve(static_cast<std::size_t>(bodies) + 1);
  return scene;
}

Scene scene_with_ground(std::string_view name, std::int64_t bodies, double side) {
  Scene scene = empty_scene(name, bodies);
  BodyDef ground;
  ground.motion = MotionType::fixed;
  Vec3 half = ground_half_extents;
  half.x = half.y = max(half.x, static_cast<float>(std::ceil(side / 2 + 10)));
  ground.shape = box(half);
  scene.bodies.push_back(ground);
  scene.names.push_back({"ground", 0});
  scene.ground_height = ground_half_extents.z;
  return scene;
}

Quat random_rotation(Random& random) {
  for (;;) {
    const double w = random.symmetric(1), x = random.symmetric(1), y = random.symmetric(1), z = random.symmetric(1);
    const double square = w * w + x * x + y * y + z * z;
    if (square > 1.0 || square < 1e-4) continue;
    const double scale = 1.0 / std::sqrt(square);
    return {static_cast<float>(scale * w), static_cast<float>(scale * x), static_cast<float>(scale * y),
            static_cast<float>(scale * z)};
  }
}

Direction::Direction(double t) {
  t -= std::floor(t);
  const int quarter = static_cast<int>(4 * t + 0.5);
  const double a = (t - 0.25 * quarter) * 6.283185307179586477;  // at most an eighth of a turn
  double c = 1, s = 0, term = 1;
  for (int k = 1; k <= 18; ++k) {
    term *= a / k;
    (k % 2 ? s : c) += k % 4 < 2 ? term : -term;
  }
  x = quarter % 4 == 0 ? c : quarter % 4 == 1 ? -s : quarter % 4 == 2 ? -c : s;
  y = quarter % 4 == 0 ? s : quarter % 4 == 1 ? c : quarter % 4 == 2 ? -s : -c;
}

}  // namespace fathom
