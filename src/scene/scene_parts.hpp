// What environments are made of.
#pragma once

#include <cstdint>
#include <string_view>

#include "scene/scene.hpp"

namespace fathom {

/// WorldDef::max_bodies at its most; the ground is one of them.
inline constexpr std::int64_t max_environment_bodies = std::int64_t{1} << 24;

/// Throws `invalid_argument` below 1, `capacity` above `most`.
void check_size(std::string_view environment, std::string_view unit, std::int64_t size, std::int64_t most);

/// Without sleeping, with room for `bodies` and the ground.
Scene empty_scene(std::string_view name, std::int64_t bodies);
/// With a ground of 1 km², or so large that it carries a square of `side` metres, whose top is at 0.5 m.
Scene scene_with_ground(std::string_view name, std::int64_t bodies, double side = 0);

/// Uniform over all rotations: a point of the unit ball in four dimensions, found by rejection, has a
/// uniform direction. It needs no sine, whose last bit differs between machines.
Quat random_rotation(Random& random);

/// Cosine and sine of a turn's part t, from sums and products alone: library functions differ in their last bits
/// between machines.
struct Direction {
  double x, y;

  explicit Direction(double t);
};

}  // namespace fathom
