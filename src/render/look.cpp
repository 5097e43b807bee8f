#include "render/look.hpp"

namespace fathom::render {
namespace {

/// Extinction with the optical depths `per_channel` at `distance` (m).
Vec3 fading(float distance, Vec3 per_channel) { return (1 / distance) * per_channel; }

}  // namespace

Look daylight(float size) {
  Look look;
  look.sun_direction = normalize(Vec3{-0.62f, -0.42f, 0.80f});
  look.sun_colour = {1.62f, 1.50f, 1.30f};
  look.ambient_up = {0.25f, 0.29f, 0.36f};
  look.ambient_down = {0.13f, 0.12f, 0.12f};
  look.zenith = {0.10f, 0.22f, 0.46f};
  look.horizon = {0.52f, 0.61f, 0.70f};
  look.nadir = {0.30f, 0.34f, 0.40f};
  look.extinction = fading(max(150.0f, 25 * size), {0.85f, 0.72f, 0.62f});
  look.ground = {0.30f, 0.31f, 0.33f};
  look.ground_line = {0.16f, 0.17f, 0.19f};
  return look;
}

Look under_water(float size, float surface) {
  Look look;
  look.sun_direction = normalize(Vec3{0.22f, -0.26f, 0.94f});
  look.sun_colour = {1.1f, 1.3f, 1.26f};
  look.ambient_up = {0.12f, 0.33f, 0.42f};
  look.ambient_down = {0.03f, 0.11f, 0.16f};
  look.zenith = {0.10f, 0.46f, 0.56f};
  look.horizon = {0.012f, 0.135f, 0.21f};
  look.nadir = {0.002f, 0.025f, 0.05f};
  // Red fades first: the proportions, not the lengths, of clear ocean water's extinction (Jerlov 1976).
  look.extinction = fading(max(30.0f, 4.5f * size), {2.6f, 1.0f, 0.72f});
  look.ground = {0.50f, 0.45f, 0.34f};
  look.ground_line = {0.40f, 0.36f, 0.27f};
  look.water = true;
  look.water_surface = surface;
  return look;
}

}  // namespace fathom::render
