#include "render/look.hpp"

namespace fathom::render {
namespace {

/// Extinction with which things at `distance` (m) keep so much of their colour, by channel.
Vec3 fading(float distance, Vec3 per_channel) { return (1 / distance) * per_channel; }

}  // namespace

Look daylight(float size) {
  Look look;
  look.sun_direction = normalize(Vec3{0.42f, -0.5f, 0.86f});
  look.sun_colour = {2.05f, 1.90f, 1.66f};
  look.ambient_up = {0.50f, 0.56f, 0.66f};
  look.ambient_down = {0.24f, 0.23f, 0.23f};
  look.zenith = {0.20f, 0.36f, 0.62f};
  look.horizon = {0.74f, 0.82f, 0.90f};
  look.nadir = {0.42f, 0.47f, 0.54f};
  look.extinction = fading(max(60.0f, 9 * size), {0.8f, 0.7f, 0.62f});
  look.ground = {0.36f, 0.37f, 0.39f};
  look.ground_line = {0.22f, 0.23f, 0.26f};
  return look;
}

Look under_water(float size, float surface) {
  Look look;
  look.sun_direction = normalize(Vec3{0.22f, -0.26f, 0.94f});
  look.sun_colour = {1.9f, 2.25f, 2.2f};
  look.ambient_up = {0.14f, 0.40f, 0.50f};
  look.ambient_down = {0.03f, 0.11f, 0.16f};
  look.zenith = {0.10f, 0.46f, 0.56f};
  look.horizon = {0.012f, 0.135f, 0.21f};
  look.nadir = {0.002f, 0.025f, 0.05f};
  // Red is gone first: of clear ocean water's extinction (Jerlov 1976) the proportions, not the lengths.
  look.extinction = fading(max(30.0f, 4.5f * size), {2.6f, 1.0f, 0.72f});
  look.ground = {0.50f, 0.45f, 0.34f};
  look.ground_line = {0.40f, 0.36f, 0.27f};
  look.water = true;
  look.water_surface = surface;
  return look;
}

}  // namespace fathom::render
