#include "render/world_colours.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace fathom::render {
namespace {

constexpr std::size_t max_layers = 1000;
constexpr float fastest = 5.0f;  // m/s, the end of the speed scale
constexpr Colour fixed_colour{150, 152, 156};
constexpr Colour kinematic_colour{214, 214, 220};
constexpr std::uint8_t asleep = 128;

/// Slightly lighter or darker, to tell neighbours of the same colour apart.
Colour varied(Colour colour, std::uint32_t slot) {
  const float factor = 1.0f + 0.16f * (static_cast<float>((slot * 2654435761u) >> 24) / 255.0f - 0.5f);
  const auto vary = [factor](std::uint8_t v) {
    return static_cast<std::uint8_t>(std::lround(min(255.0f, factor * static_cast<float>(v))));
  };
  return {vary(colour.r), vary(colour.g), vary(colour.b)};
}

/// Slots up to the last body's, without reading poses.
std::size_t slots_of(const World& world) { return world.bodies().empty() ? 0 : world.bodies().back().index + 1; }

/// Height in centimetres.
int height_step(float z) { return static_cast<int>(std::lround(100.0f * clamp(z, -1e6f, 1e6f))); }

}  // namespace

void WorldColours::colour_new_bodies(const World& world) {
  const std::size_t slots = slots_of(world);
  std::map<int, std::size_t> heights;
  if (known_.empty()) {
    for (const BodyId id : world.bodies())
      if (world.motion(id) == MotionType::dynamic) heights[height_step(world.poses()[id.index].position.z)] = 0;
  }
  if (slots > known_.size()) {
    start_.resize(slots);
    known_.resize(slots);
  }
  const bool in_layers =
      heights.size() > 1 && heights.size() <= max_layers && 4 * heights.size() <= world.bodies().size();
  std::size_t rank = 0;
  for (auto& height : heights) height.second = rank++;
  for (const BodyId id : world.bodies()) {
    if (known_[id.index] == id) continue;
    known_[id.index] = id;
    Colour& colour = start_[id.index];
    if (world.motion(id) != MotionType::dynamic) {
      colour = world.motion(id) == MotionType::fixed ? fixed_colour : kinematic_colour;
    } else if (in_layers) {
      const std::size_t layer = heights.at(height_step(world.poses()[id.index].position.z));
      colour = varied(sunset(static_cast<float>(layer) / static_cast<float>(heights.size() - 1)), id.index);
    } else {
      colour = varied(scattered(id.index), id.index);
    }
  }
}

// Islands of touching bodies, ignoring fixed ones: the lowest slot of each, by union-find with path halving.
void WorldColours::find_islands(const World& world) {
  island_.resize(slots_of(world));
  for (std::uint32_t slot = 0; slot < island_.size(); ++slot) island_[slot] = slot;
  const auto root = [this](std::uint32_t slot) {
    while (island_[slot] != slot) slot = island_[slot] = island_[island_[slot]];
    return slot;
  };
  world.for_each_contact([&](const ContactInfo& contact) {
    if (world.motion(contact.a) != MotionType::dynamic || world.motion(contact.b) != MotionType::dynamic) return;
    const std::uint32_t a = root(contact.a.index), b = root(contact.b.index);
    island_[std::max(a, b)] = std::min(a, b);
  });
  for (std::uint32_t slot = 0; slot < island_.size(); ++slot) island_[slot] = root(slot);
}

Colour WorldColours::colour_of(const World& world, BodyId id, Colouring colouring) const {
  const Colour own = start_[id.index];
  if (world.motion(id) != MotionType::dynamic) return own;
  switch (colouring) {
    case Colouring::start:
      return own;
    case Colouring::speed:
      return turbo(length(world.velocities()[id.index].linear) / fastest);
    case Colouring::island:
      return varied(scattered(island_[id.index]), island_[id.index]);
  }
  return own;
}

std::span<const Colour> WorldColours::update(const World& world, Colouring colouring) {
  colour_new_bodies(world);
  if (colouring == Colouring::island) find_islands(world);
  colours_.resize(slots_of(world));
  for (const BodyId id : world.bodies()) {
    Colour colour = colour_of(world, id, colouring);
    if (world.motion(id) == MotionType::dynamic && !world.is_awake(id)) colour.a = asleep;
    colours_[id.index] = colour;
  }
  return colours_;
}

}  // namespace fathom::render
