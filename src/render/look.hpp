// Light, atmosphere and ground of a picture. Colours are linear, not sRGB.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

namespace fathom::render {

enum class LookKind : std::uint8_t { daylight, water };

struct Look {
  Vec3 sun_direction{};  ///< unit, towards the sun
  Vec3 sun_colour{};
  Vec3 ambient_up{};  ///< light on surfaces that face up
  Vec3 ambient_down{};
  Vec3 zenith{};  ///< background straight up, at the horizon, straight down
  Vec3 horizon{};
  Vec3 nadir{};
  Vec3 extinction{};  ///< 1/m by channel: how fast objects fade into the background
  Vec3 ground{};
  Vec3 ground_line{};
  bool water = false;       ///< sunlight comes through water, in waves
  float water_surface = 0;  ///< m, height of the water's surface
};

/// Daylight. `size` (m) is the extent of the scene: haze begins beyond it.
Look daylight(float size);
/// Under water with its surface at height `surface` (m). `size` as above.
Look under_water(float size, float surface);

}  // namespace fathom::render
