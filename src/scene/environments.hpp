// The four published environments, any size. Their bodies are unit cubes of 1 kg; sleeping is off.
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
/// ⌊√n⌋ × ⌊√n⌋ bodies side by side on the ground, 1.1 m apart.
Scene spread(std::int64_t bodies);
/// A pyramid of square layers, 1.05 m apart: L² bodies at the bottom, one at the top.
Scene pyramid(std::int64_t layers);

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
