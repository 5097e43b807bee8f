// The four published environments, whose bodies are unit cubes of 1 kg, and two of bricks, any size. Sleeping is off.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "scene/scene.hpp"

namespace fathom {

// Sizes below 1 throw `invalid_argument`, sizes beyond what a world holds `capacity`.

/// Bodies adrift without ground or gravity: random poses in a cube of n·(4 m)³, kicked every 30 steps.
Scene drift(std::int64_t bodies);
/// A tower of layers of 10 × 10 bodies, 1.1 m apart, that fall on each other; the last may be partial.
Scene layers(std::int64_t bodies);
/// ⌊√n⌋ × ⌊√n⌋ bodies side by side on the ground, 1.1 m apart; the ground is larger from 800,000 bodies on.
Scene spread(std::int64_t bodies);
/// A pyramid of square layers, 1.05 m apart: L² bodies at the bottom, one at the top.
Scene pyramid(std::int64_t layers);

/// A round wall of n bricks of 0.5 × 0.5 × 0.25 m and 1 kg, about twenty times as long as high, that two balls of 200
/// kg hit from opposite sides at 30 m/s after a third of a second.
Scene ring(std::int64_t bodies);
/// n such bricks in walls of 50 by 20, 4 m apart in rows 30 m apart; a ball hits the first wall of every row.
Scene walls(std::int64_t bodies);

/// Bodies of a pyramid with so many layers, and the most layers that so many bodies build.
std::int64_t pyramid_bodies(std::int64_t layers);
std::int64_t pyramid_layers(std::int64_t bodies);

/// How an environment is asked for by name.
struct Environment {
  std::string_view name;
  std::string_view summary;
  std::int64_t default_bodies;
  /// Whether its size may be given in layers, and the bodies of so many.
  std::int64_t (*bodies_of_layers)(std::int64_t layers);
  /// The scene with (at most) so many bodies.
  Scene (*make)(std::int64_t bodies);
};

std::span<const Environment> environments();
/// The environment of that name, or null.
const Environment* find_environment(std::string_view name);

}  // namespace fathom
