// Light, air and ground of a picture. Colours are linear, not sRGB.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

namespace fathom::render {

enum class LookKind : std::uint8_t { daylight, water };

struct Look {
  Vec3 sun_direction{};  ///< unit, towards the sun
  Vec3 sun_colour{};
  Vec3 ambient_up{};  ///< light on what faces up
  Vec3 ambient_down{};
  Vec3 zenith{};  ///< background straight up, at the horizon, straight down
  Vec3 horizon{};
  Vec3 nadir{};
  Vec3 extinction{};  ///< 1/m by channel: how fast things fade into the background
  Vec3 ground{};
  Vec3 ground_line{};
  bool water = false;       ///< the sun comes through water, in waves
  float water_surface = 0;  ///< m, height of the water's surface
};

/// In daylight. `size` (m) is that of what is looked at: haze begins beyond it.
Look daylight(float size);
/// Under water, `surface` metres high. The same for `size`.
Look under_water(float size, float surface);

}  // namespace fathom::render
