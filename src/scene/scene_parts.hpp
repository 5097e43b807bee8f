// Building blocks of environments.
#pragma once

#include <cstdint>
#include <string_view>

#include "scene/scene.hpp"

namespace fathom {

/// Maximum of WorldDef::max_bodies; the ground is one of them.
inline constexpr std::int64_t max_environment_bodies = std::int64_t{1} << 24;

/// Throws `invalid_argument` below 1, `capacity` above `most`.
void check_size(std::string_view environment, std::string_view unit, std::int64_t size, std::int64_t most);

/// A scene without sleeping, with room for `bodies` and the ground.
Scene empty_scene(std::string_view name, std::int64_t bodies);
/// A scene with a ground of at least 1 km² that fits a square of `side` metres; its top is at 0.5 m.
Scene scene_with_ground(std::string_view name, std::int64_t bodies, double side = 0);

/// Uniform over all rotations: a point of the unit ball in four dimensions, found by rejection, has a uniform
/// direction. This needs no sine, whose last bit differs between machines.
Quat random_rotation(Random& random);

/// Cosine and sine of the fraction t of a turn, from sums and products alone: library functions differ in their last
/// bits between machines.
struct Direction {
  double x, y;

  explicit Direction(double t);
};

}  // namespace fathom
